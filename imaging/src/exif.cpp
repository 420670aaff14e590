#include "fieldmark/imaging/exif.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <optional>

#include "fieldmark/imaging/image_format.h"
#include "jpeg_segments.h"

namespace fieldmark {
namespace {

constexpr int kApp1 = 0xe1, kUpright = 1;
constexpr std::uint32_t kOrientation = 0x0112, kShort = 3;
constexpr std::size_t kEntry = 12;

// Reads numbers of a TIFF structure, whose first two bytes give the byte order.
class Tiff {
 public:
  explicit Tiff(std::span<const std::byte> bytes)
      : bytes_(bytes), big_(!bytes.empty() && bytes[0] == std::byte{'M'}) {}
  // Returns nullopt beyond the end.
  std::optional<std::uint32_t> number(std::size_t at, std::size_t size) const {
    if (at > bytes_.size() || size > bytes_.size() - at) return std::nullopt;
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size; ++i)
      value = value << 8 | std::to_integer<std::uint32_t>(bytes_[big_ ? at + i : at + size - 1 - i]);
    return value;
  }

 private:
  std::span<const std::byte> bytes_;
  bool big_;
};

std::optional<int> orientation(std::span<const std::byte> tiff_bytes) {
  const Tiff tiff(tiff_bytes);
  const auto magic = tiff.number(2, 2), directory = tiff.number(4, 4);
  if (!directory || magic != 42u) return std::nullopt;
  const std::uint32_t entries = tiff.number(*directory, 2).value_or(0);
  for (std::size_t k = 0; k < entries; ++k) {
    const std::size_t entry = *directory + 2 + k * kEntry;
    const auto tag = tiff.number(entry, 2);
    if (!tag) return std::nullopt;
    if (*tag != kOrientation) continue;
    const auto value = tiff.number(entry + 8, 2);
    if (tiff.number(entry + 2, 2) != kShort || !value || *value < 1 || *value > 8) return std::nullopt;
    return static_cast<int>(*value);
  }
  return std::nullopt;
}

// Returns the EXIF chunk of a WebP file; empty if there is none. Some writers prepend the name of JPEG's
// segment. Source: RFC 9649, 2.3 and 2.7.1.5.
std::span<const std::byte> exif_of_webp(std::span<const std::byte> bytes) {
  constexpr std::size_t kFile = 12, kHead = 8;
  for (std::size_t at = kFile; at + kHead <= bytes.size();) {
    std::size_t size = 0;
    for (std::size_t i = 0; i < 4; ++i) size |= std::to_integer<std::size_t>(bytes[at + 4 + i]) << 8 * i;
    if (size > bytes.size() - at - kHead) return {};
    if (std::memcmp(bytes.data() + at, "EXIF", 4) == 0) return bytes.subspan(at + kHead, size);
    at += kHead + size + size % 2;
  }
  return {};
}

}  // namespace

int exif_orientation(std::span<const std::byte> bytes) {
  constexpr char kName[] = "Exif\0";  // and the 0 that terminates the literal
  const auto name = std::as_bytes(std::span(kName));
  const auto is_named = [&](std::span<const std::byte> payload) {
    return payload.size() > name.size() && std::ranges::equal(payload.first(name.size()), name);
  };
  if (image_format(bytes) == ImageFormat::webp) {
    const auto exif = exif_of_webp(bytes);
    return orientation(is_named(exif) ? exif.subspan(name.size()) : exif).value_or(kUpright);
  }
  if (!is_jpeg(bytes)) return kUpright;
  for (const auto& [marker, payload] : jpeg_segments(bytes).segments)
    if (marker == kApp1 && is_named(payload))
      return orientation(payload.subspan(name.size())).value_or(kUpright);
  return kUpright;
}

Tensor<float> turned(const Tensor<float>& image, int orientation) {
  const Index h = image.shape[0], w = image.shape[1], channels = image.shape[2];
  const bool across = orientation >= 5;
  Tensor<float> out(across ? Shape{w, h, channels} : Shape{h, w, channels});
  for (Index y = 0; y < out.shape[0]; ++y)
    for (Index x = 0; x < out.shape[1]; ++x) {
      Index row = across ? x : y, column = across ? y : x;
      if (orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7) row = h - 1 - row;
      if (orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8)
        column = w - 1 - column;
      std::copy_n(&image[(row * w + column) * channels], channels, &out[(y * out.shape[1] + x) * channels]);
    }
  return out;
}

}  // namespace fieldmark
