#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace fieldmark {

/// True if this build has libjpeg-turbo.
bool has_jpeg_turbo();

/// Encodes a baseline JPEG file with libjpeg-turbo, the tables of ITU-T T.81, annex K, and the accurate
/// integer DCT.
/// @param pixels  [height, width, channels] interleaved   @param channels  1 or 3
/// @param full_chroma  true: 4:4:4; false: 4:2:0
/// @throws ValueError naming the Debian package if this build lacks libjpeg-turbo   @throws Error if it fails
std::vector<std::byte> encode_jpeg_turbo(std::span<const std::uint8_t> pixels, int height, int width,
                                         int channels, int quality, bool full_chroma);

}  // namespace fieldmark
