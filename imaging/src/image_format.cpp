#include "fieldmark/imaging/image_format.h"

#include <fieldmark/core/error.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "jpeg_segments.h"
#include "png_chunks.h"

namespace fieldmark {
namespace {

using Bytes = std::span<const std::byte>;

constexpr std::array<std::string_view, 10> kExtensions{".png",  ".jpg",  ".jpeg", ".jpe",  ".jfif",
                                                       ".webp", ".avif", ".heic", ".heif", ".hif"};

bool has_at(Bytes bytes, std::size_t at, std::string_view text) {
  return bytes.size() >= at + text.size() && std::memcmp(bytes.data() + at, text.data(), text.size()) == 0;
}

// ISO/IEC 14496-12: the type follows the length of the first box, and the brands are in that box. The major
// brand may be generic, so the compatible ones decide.
ImageFormat format_of_boxes(Bytes bytes) {
  constexpr std::array<std::string_view, 2> kAvif{"avif", "avis"};
  constexpr std::array<std::string_view, 8> kHeic{"heic", "heix", "heim", "heis",
                                                  "hevc", "hevx", "mif1", "msf1"};
  constexpr std::size_t kMajor = 8, kMinor = 12, kBrand = 4;
  std::size_t size = 0;
  for (std::size_t i = 0; i < 4; ++i) size = size << 8 | std::to_integer<std::size_t>(bytes[i]);
  const auto has_brand = [&](const auto& brands) {
    for (std::size_t at = kMajor; at + kBrand <= std::min(size, bytes.size()); at += kBrand)
      if (at != kMinor && std::ranges::any_of(brands, [&](auto brand) { return has_at(bytes, at, brand); }))
        return true;
    return false;
  };
  if (has_brand(kAvif)) return ImageFormat::avif;
  return has_brand(kHeic) ? ImageFormat::heic : ImageFormat::video;
}

}  // namespace

ImageFormat image_format(Bytes bytes) {
  using enum ImageFormat;
  if (is_png(bytes)) return png;
  if (is_jpeg(bytes)) return jpeg;
  if (has_at(bytes, 0, "RIFF") && has_at(bytes, 8, "WEBP")) return webp;
  if (has_at(bytes, 4, "ftyp")) return format_of_boxes(bytes);
  // A QuickTime film may begin without brands. Matroska and WebM begin with an EBML header.
  for (const std::string_view box : {"moov", "mdat", "wide", "free", "skip", "pnot"})
    if (has_at(bytes, 4, box)) return video;
  if (has_at(bytes, 0, "\x1a\x45\xdf\xa3")) return video;
  return unknown;
}

ImageFormat image_format(const std::filesystem::path& path) {
  std::array<char, 64> first{};
  std::ifstream file(path, std::ios::binary);
  if (!file) throw IoError("[read] " + path.string() + ": open failed: " + std::strerror(errno));
  file.read(first.data(), std::ssize(first));
  return image_format(std::as_bytes(std::span(first)).first(static_cast<std::size_t>(file.gcount())));
}

std::string_view format_name(ImageFormat format) {
  switch (format) {
    case ImageFormat::unknown:
      break;
    case ImageFormat::png:
      return "PNG";
    case ImageFormat::jpeg:
      return "JPEG";
    case ImageFormat::webp:
      return "WebP";
    case ImageFormat::avif:
      return "AVIF";
    case ImageFormat::heic:
      return "HEIC";
    case ImageFormat::video:
      return "video";
  }
  return "unknown";
}

bool is_built_in(ImageFormat format) {
  switch (format) {
    case ImageFormat::png:
    case ImageFormat::jpeg:
      return true;
#ifdef FIELDMARK_WITH_WEBP
    case ImageFormat::webp:
      return true;
#endif
#ifdef FIELDMARK_WITH_AVIF
    case ImageFormat::avif:
      return true;
#endif
#ifdef FIELDMARK_WITH_HEIC
    case ImageFormat::heic:
      return true;
#endif
    default:
      return false;
  }
}

std::string missing_library(std::string_view what, std::string_view library, std::string_view package) {
  return std::string(what) + " need " + std::string(library) +
         ", which this build of Fieldmark lacks; install " + std::string(package) + " and build again";
}

std::span<const std::string_view> image_extensions() { return kExtensions; }

bool has_image_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return std::ranges::find(kExtensions, extension) != kExtensions.end();
}

std::string image_oddity(Bytes bytes) {
  const bool png = is_png(bytes);
  if (!png && !is_jpeg(bytes)) return "";
  std::size_t end = 0;
  bool complete = false;
  if (png) {
    const PngChunks chunks = png_chunks(bytes);
    end = chunks.end, complete = chunks.complete;
  } else {
    const JpegSegments segments = jpeg_segments(bytes);
    end = segments.end, complete = segments.complete;
  }
  const std::string file = png ? "PNG file" : "JPEG file";
  if (!complete) return "the " + file + " has no end marker; its image is complete";
  if (end == bytes.size()) return "";
  return std::to_string(bytes.size() - end) + " bytes behind the end of the " + file + " are ignored";
}

}  // namespace fieldmark
