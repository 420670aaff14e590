#include <fieldmark/imaging/jpeg_file.h>

#include <algorithm>
#include <cstdint>
#include <optional>

#include "jpeg_segments.h"

namespace fieldmark {
namespace {

constexpr int kApp1 = 0xe1, kUpright = 1;
constexpr std::uint32_t kOrientation = 0x0112, kShort = 3;
constexpr std::size_t kEntry = 12;

// The numbers of a TIFF structure, whose first two bytes tell their order.
class Tiff {
 public:
  explicit Tiff(std::span<const std::byte> bytes)
      : bytes_(bytes), big_(!bytes.empty() && bytes[0] == std::byte{'M'}) {}
  // Nothing beyond the end.
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

}  // namespace

int exif_orientation(std::span<const std::byte> bytes) {
  constexpr char kName[] = "Exif\0";  // and the 0 that ends the literal
  const auto name = std::as_bytes(std::span(kName));
  if (!is_jpeg(bytes)) return kUpright;
  for (const auto& [marker, payload] : jpeg_segments(bytes).segments)
    if (marker == kApp1 && payload.size() > name.size() &&
        std::ranges::equal(payload.first(name.size()), name))
      return orientation(payload.subspan(name.size())).value_or(kUpright);
  return kUpright;
}

std::string jpeg_oddity(std::span<const std::byte> bytes) {
  if (!is_jpeg(bytes)) return "";
  const JpegSegments parts = jpeg_segments(bytes);
  if (!parts.complete) return "the JPEG file has no end marker; its image is complete";
  if (parts.end == bytes.size()) return "";
  return std::to_string(bytes.size() - parts.end) + " bytes behind the end of the JPEG file are ignored";
}

}  // namespace fieldmark
