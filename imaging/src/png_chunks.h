#pragma once
#include <cstddef>
#include <span>

namespace fieldmark {

/// Where a PNG file ends.
/// Source: W3C, Portable Network Graphics (second edition), 5.3.
struct PngChunks {
  std::size_t end = 0;  ///< first byte behind the end chunk; behind the last whole chunk where there is none
  bool complete = false;  ///< there is an end chunk
  bool has_data = false;  ///< there is a chunk of pixels
  std::size_t lacks = 0;  ///< bytes of the checksum of the last chunk, 0 to 4, that are behind the end
};

/// Whether the bytes begin as a PNG file does.
bool is_png(std::span<const std::byte> bytes);

/// Steps through a PNG file, never beyond its bytes. @param bytes  see is_png()
PngChunks png_chunks(std::span<const std::byte> bytes);

}  // namespace fieldmark
