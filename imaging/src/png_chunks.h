#pragma once
#include <cstddef>
#include <span>

namespace fieldmark {

/// The end of a PNG file.
/// Source: W3C, Portable Network Graphics (second edition), 5.3.
struct PngChunks {
  std::size_t end = 0;    ///< first byte after the end chunk; after the last whole chunk if there is none
  bool complete = false;  ///< true if there is an end chunk
  bool has_data = false;  ///< true if there is a chunk of pixels
  std::size_t lacks = 0;  ///< bytes of the last chunk's checksum that lie beyond the end, 0 to 4
};

/// True if the bytes start with the signature of PNG.
bool is_png(std::span<const std::byte> bytes);

/// Parses the chunks of a PNG file. Never reads beyond the bytes. @param bytes  see is_png()
PngChunks png_chunks(std::span<const std::byte> bytes);

}  // namespace fieldmark
