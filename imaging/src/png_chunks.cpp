#include "png_chunks.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace fieldmark {
namespace {

constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";
constexpr std::size_t kHead = 8, kChecksum = 4;  // length and type; CRC

bool is_kind(std::span<const std::byte> chunk, std::string_view kind) {
  return std::memcmp(chunk.data() + 4, kind.data(), kind.size()) == 0;
}

}  // namespace

bool is_png(std::span<const std::byte> bytes) {
  return bytes.size() >= kSignature.size() &&
         std::memcmp(bytes.data(), kSignature.data(), kSignature.size()) == 0;
}

PngChunks png_chunks(std::span<const std::byte> bytes) {
  PngChunks found{.end = std::min(bytes.size(), kSignature.size())};
  while (bytes.size() - found.end >= kHead) {
    const auto chunk = bytes.subspan(found.end);
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) length = length << 8 | std::to_integer<std::size_t>(chunk[i]);
    if (length > chunk.size() - kHead) break;
    const std::size_t whole = kHead + length + kChecksum;
    found.lacks = whole - std::min(whole, chunk.size());
    found.end += whole - found.lacks;
    found.has_data = found.has_data || is_kind(chunk, "IDAT");
    if (is_kind(chunk, "IEND")) {
      found.complete = true;
      break;
    }
  }
  return found;
}

}  // namespace fieldmark
