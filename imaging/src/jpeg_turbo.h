#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace fieldmark {

/// Whether this build has libjpeg-turbo.
bool has_jpeg_turbo();

/// A baseline JPEG file by libjpeg-turbo, with the tables of ITU-T T.81, annex K, and the accurate integer
/// DCT.
/// @param pixels  [height, width, channels] interleaved   @param channels  1 or 3
/// @param full_chroma  4:4:4 in place of 4:2:0
/// @throws ValueError naming the Debian package if this build lacks libjpeg-turbo   @throws Error if it fails
std::vector<std::byte> encode_jpeg_turbo(std::span<const std::uint8_t> pixels, int height, int width,
                                         int channels, int quality, bool full_chroma);

}  // namespace fieldmark
