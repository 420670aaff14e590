#include <fieldmark/core/files.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/imaging/image.h>

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <memory>
#include <string>

#include "avif_file.h"
#include "decoding.h"
#include "fieldmark/imaging/image_format.h"
#include "heic_file.h"
#include "jpeg_segments.h"
#include "jpeg_turbo.h"
#include "png_chunks.h"
#include "webp_file.h"

// Static, private to this file: a program with its own copy of stb does not collide with ours.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wunused-function"
#define STB_IMAGE_STATIC
#ifdef __clang_analyzer__  // clang-tidy sees declarations alone: warnings inside stb are not ours to fix
static unsigned char* stbi_write_png_to_mem(const unsigned char*, int, int, int, int, int*);
#else
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_WRITE_IMPLEMENTATION
#endif
#define STBI_NO_STDIO
// Zeros, so that what a damaged file leaves unset is at least the same each time.
#define STBI_MALLOC(size) std::calloc(1, size)
#define STBI_REALLOC(p, size) std::realloc(p, size)
#define STBI_FREE(p) std::free(p)
#define STBI_ONLY_PNG
#define STBI_ONLY_JPEG
#include <stb/stb_image.h>
#define STB_IMAGE_WRITE_STATIC
#define STBI_WRITE_NO_STDIO
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

namespace fieldmark {
namespace {

struct Free {
  void operator()(void* p) const { std::free(p); }
};
using Pixels = std::unique_ptr<unsigned char, Free>;

// The only conversion from a byte, so that an image that is read equals the quantised image.
float unit(std::uint8_t byte) { return static_cast<float>(byte) / 255.0f; }

std::uint8_t byte_of(float x) {
  const float scaled = x > 0 ? std::min(x, 1.0f) * 255.0f + 0.5f : 0.0f;  // NaN is not > 0
  return static_cast<std::uint8_t>(scaled);
}

void check_image(const char* op, const Tensor<float>& image, Index max_side) {
  const Shape& s = image.shape;
  check_rank(op, "image", s, 3, "[height, width, channels]");
  const bool channels = s[2] >= 1 && s[2] <= 4;
  // stb counts bytes in an int.
  if (!channels || s[0] < 1 || s[1] < 1 || s[0] > max_side || s[1] > max_side ||
      s[0] * (s[1] * s[2] + 1) > std::numeric_limits<int>::max() / 2)
    throw ShapeError("[" + std::string(op) + "] image: height and width must be from 1 to " +
                     std::to_string(max_side) + ", channels from 1 to 4, 2^30 bytes in all, got shape " +
                     s.str());
}

constexpr std::size_t kMaxBytes = std::numeric_limits<int>::max();
constexpr int kScan = 0xda, kRestartInterval = 0xdd;

const unsigned char* data_of(std::span<const std::byte> bytes) {
  return reinterpret_cast<const unsigned char*>(bytes.data());
}

// Returns the pixels of a file, or an empty tensor; stb then holds the reason.
Tensor<float> pixels_of(std::span<const std::byte> bytes, int want_channels) {
  const int size = static_cast<int>(bytes.size());
  int width = 0, height = 0, channels = 0;
  Tensor<float> image;
  const auto store = [&](const auto* values, auto to_unit) {
    if (!values) return;
    image = Tensor<float>(Shape{height, width, want_channels ? want_channels : channels});
    std::transform(values, values + image.size(), image.data.begin(), to_unit);
  };
  if (stbi_is_16_bit_from_memory(data_of(bytes), size)) {
    const std::unique_ptr<stbi_us, Free> values(
        stbi_load_16_from_memory(data_of(bytes), size, &width, &height, &channels, want_channels));
    store(values.get(), [](stbi_us x) { return static_cast<float>(x) / 65535.0f; });
  } else {
    const Pixels values(
        stbi_load_from_memory(data_of(bytes), size, &width, &height, &channels, want_channels));
    store(values.get(), unit);
  }
  return image;
}

// Decodes a JPEG file with other data in place of its end. stb reads zeros after the last byte and reports
// success, so only an image that does not depend on the data appended is complete.
Tensor<float> continued(std::span<const std::byte> bytes, std::byte filler, int want_channels) {
  constexpr std::size_t kFillers = 256;
  while (!bytes.empty() && bytes.back() == std::byte{0xff}) bytes = bytes.first(bytes.size() - 1);
  std::vector<std::byte> file(bytes.begin(), bytes.end());
  file.insert(file.end(), kFillers, filler);
  file.insert(file.end(), {std::byte{0xff}, std::byte{0xd9}});
  return huffman_tables_fit(file) ? pixels_of(file, want_channels) : Tensor<float>{};
}

// Returns the pixels of a JPEG file without an end marker, or an empty tensor if some are missing.
Tensor<float> unended(std::span<const std::byte> bytes, const JpegSegments& parts, int want_channels) {
  // stb stops at a missing restart marker and leaves the remaining pixels undefined.
  const auto restarts = [](const JpegSegment& s) { return s.marker == kRestartInterval; };
  if (!parts.sends_every_coefficient() || std::ranges::any_of(parts.segments, restarts)) return {};
  // A block of 8 x 8 pixels takes at least one bit.
  int width = 0, height = 0, channels = 0;
  if (!stbi_info_from_memory(data_of(bytes), static_cast<int>(bytes.size()), &width, &height, &channels) ||
      static_cast<double>(width) * height > 512.0 * static_cast<double>(bytes.size()))
    return {};
  Tensor<float> image = continued(bytes, std::byte{0}, want_channels);
  for (const int filler : {0x55, 0xaa, 0x37})
    if (continued(bytes, static_cast<std::byte>(filler), want_channels).data != image.data) return {};
  return image;
}

// Returns the pixels of a PNG file without an end chunk, or an empty tensor if part of the image is missing.
// Nothing after the end of its compressed data is read.
Tensor<float> unended(std::span<const std::byte> bytes, const PngChunks& chunks, int want_channels) {
  constexpr std::size_t kFillers = 64;
  if (!chunks.has_data) return {};
  const auto continued_by = [&](std::byte filler) {
    std::vector<std::byte> file(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(chunks.end));
    std::fill_n(std::back_inserter(file), chunks.lacks, std::byte{0});
    const auto add = [&](std::string_view kind, std::size_t size) {
      file.insert(file.end(), {std::byte{0}, std::byte{0}, std::byte{0}, static_cast<std::byte>(size)});
      for (const char c : kind) file.push_back(static_cast<std::byte>(c));
      std::fill_n(std::back_inserter(file), size + 4, filler);
    };
    add("IDAT", kFillers);
    add("IEND", 0);
    return pixels_of(file, want_channels);
  };
  Tensor<float> image = continued_by(std::byte{0});
  for (const int filler : {0x55, 0xaa, 0xff})
    if (continued_by(static_cast<std::byte>(filler)).data != image.data) return {};
  return image;
}

// Decodes a file with stb, which reads past the end of a JPEG file and rejects a PNG file without an end.
Tensor<float> decode_by_stb(std::span<const std::byte> bytes, int want_channels) {
  if (bytes.size() > kMaxBytes - 1024) throw Undecodable("more than 2^31 bytes");
  if (is_jpeg(bytes) && !huffman_tables_fit(bytes))
    throw Undecodable("a Huffman table of more than 255 symbols, damaged");
  int width = 0, height = 0, channels = 0;
  if (stbi_info_from_memory(data_of(bytes), static_cast<int>(bytes.size()), &width, &height, &channels))
    check_area(width, height, bytes.size());
  bool complete = true;
  Tensor<float> image;
  if (is_jpeg(bytes)) {
    const JpegSegments parts = jpeg_segments(bytes);
    // stb would return uninitialised memory.
    if (std::ranges::none_of(parts.segments, [](const JpegSegment& s) { return s.marker == kScan; }))
      throw Undecodable("a JPEG file without an image, truncated");
    if (!parts.defines_tables())
      throw Undecodable("a scan without its Huffman or quantisation table, damaged");
    complete = parts.complete;
    image = complete ? pixels_of(bytes, want_channels) : unended(bytes, parts, want_channels);
  } else {
    const PngChunks chunks = png_chunks(bytes);
    complete = chunks.complete;
    image = complete ? pixels_of(bytes, want_channels) : unended(bytes, chunks, want_channels);
  }
  if (image.data.empty()) throw Undecodable(complete ? stbi_failure_reason() : "no end marker, truncated");
  return image;
}

Tensor<float> decode(std::span<const std::byte> bytes, std::string_view name, int want_channels) {
  try {
    switch (image_format(bytes)) {
      case ImageFormat::png:
      case ImageFormat::jpeg:
        return decode_by_stb(bytes, want_channels);
      case ImageFormat::webp:
        return decode_webp(bytes);
      case ImageFormat::avif:
        return decode_avif(bytes);
      case ImageFormat::heic:
        return decode_heic(bytes);
      case ImageFormat::video:
        throw Undecodable("a video, whose frames extract, verify, trace and null read");
      case ImageFormat::unknown:
        break;
    }
    throw Undecodable("unknown image type");
  } catch (const Undecodable& e) {
    throw IoError("[read_image] " + std::string(name) +
                  ": expected a PNG, JPEG, WebP, AVIF or HEIC image, found " + std::to_string(bytes.size()) +
                  " bytes that do not decode: " + e.what());
  }
}

}  // namespace

Tensor<float> decode_image(std::span<const std::byte> bytes, std::string_view name) {
  return decode(bytes, name, 0);
}

Tensor<float> read_image(const std::filesystem::path& path) {
  return decode(read_bytes(path), path.string(), 0);
}

void write_png(const std::filesystem::path& path, const Tensor<float>& image) {
  check_image("write_png", image, 1 << 24);
  const auto pixels = bytes_of(image);
  const int width = static_cast<int>(image.shape[1]), channels = static_cast<int>(image.shape[2]);
  int size = 0;
  const Pixels png(stbi_write_png_to_mem(pixels.data(), width * channels, width,
                                         static_cast<int>(image.shape[0]), channels, &size));
  if (!png)
    throw IoError("[write_png] " + path.string() + ": no memory to encode shape " + image.shape.str());
  write_file_atomically(path, std::as_bytes(std::span(png.get(), static_cast<std::size_t>(size))));
}

std::vector<std::byte> encode_jpeg(const Tensor<float>& image, int quality, Chroma chroma) {
  check_image("encode_jpeg", image, 65535);
  if (image.shape[2] == 2 || image.shape[2] == 4)
    throw ShapeError("[encode_jpeg] image: channels must be 1 or 3 (JPEG has no alpha), got shape " +
                     image.shape.str());
  if (quality < 1 || quality > 100)
    throw ValueError("[encode_jpeg] quality must be from 1 to 100, got " + std::to_string(quality));
  const auto pixels = bytes_of(image);
  // stb halves chroma up to this quality, never above.
  if (constexpr int kHalvedByStb = 90; quality > kHalvedByStb || chroma == Chroma::full)
    return encode_jpeg_turbo(pixels, static_cast<int>(image.shape[0]), static_cast<int>(image.shape[1]),
                             static_cast<int>(image.shape[2]), quality, chroma == Chroma::full);
  std::vector<std::byte> out;
  auto append = [](void* context, void* data, int size) {
    const auto* bytes = static_cast<const std::byte*>(data);
    auto& to = *static_cast<std::vector<std::byte>*>(context);
    to.insert(to.end(), bytes, bytes + size);
  };
  if (!stbi_write_jpg_to_func(append, &out, static_cast<int>(image.shape[1]),
                              static_cast<int>(image.shape[0]), static_cast<int>(image.shape[2]),
                              pixels.data(), quality))
    throw Error("[encode_jpeg] the encoder refused shape " + image.shape.str());
  return out;
}

Tensor<float> jpeg_round_trip(const Tensor<float>& image, int quality, Chroma chroma) {
  const auto file = encode_jpeg(image, quality, chroma);
  return decode(file, "JPEG in memory", static_cast<int>(image.shape[2]));
}

std::vector<std::uint8_t> bytes_of(const Tensor<float>& image) {
  std::vector<std::uint8_t> bytes(image.data.size());
  std::transform(image.data.begin(), image.data.end(), bytes.begin(), byte_of);
  return bytes;
}

Tensor<float> quantize8(const Tensor<float>& image) {
  Tensor<float> out(image.shape);
  std::transform(image.data.begin(), image.data.end(), out.data.begin(),
                 [](float x) { return unit(byte_of(x)); });
  return out;
}

void paste(Tensor<float>& canvas, const Tensor<float>& image, Index row, Index column) {
  const Shape& c = canvas.shape;
  const Shape& p = image.shape;
  check_rank("paste", "canvas", c, 3, "[height, width, channels]");
  check_rank("paste", "image", p, 3, "[height, width, channels]");
  check_extent("paste", "image", p, 2, c[2], "the canvas has as many channels");
  if (row < 0 || column < 0 || row + p[0] > c[0] || column + p[1] > c[1])
    throw ShapeError("[paste] image: must fit into the canvas " + c.str() + " at (" + std::to_string(row) +
                     ", " + std::to_string(column) + "), got shape " + p.str());
  const Index line = p[1] * p[2];
  for (Index y = 0; y < p[0]; ++y)
    std::copy_n(image.data.begin() + y * line, line,
                canvas.data.begin() + ((row + y) * c[1] + column) * c[2]);
}

Tensor<float> tile(std::span<const Tensor<float>> images, Index columns, Index gap, float background) {
  if (images.empty()) throw ValueError("[tile] images must be at least one, got 0");
  if (columns < 1 || gap < 0)
    throw ValueError("[tile] columns must be at least 1 and gap at least 0, got " + std::to_string(columns) +
                     " and " + std::to_string(gap));
  Index height = 0, width = 0;
  for (const auto& p : images) {
    check_rank("tile", "images", p.shape, 3, "[height, width, channels]");
    height = std::max(height, p.shape[0]);
    width = std::max(width, p.shape[1]);
  }
  const Index count = static_cast<Index>(images.size());
  columns = std::min(columns, count);
  const Index rows = (count + columns - 1) / columns;
  Tensor<float> sheet(Shape{rows * (height + gap) - gap, columns * (width + gap) - gap, images[0].shape[2]},
                      background);
  for (Index i = 0; i < count; ++i)
    paste(sheet, images[static_cast<std::size_t>(i)], i / columns * (height + gap),
          i % columns * (width + gap));
  return sheet;
}

}  // namespace fieldmark
