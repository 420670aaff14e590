#pragma once
// Code shared by the decoders of all formats.
#include <fieldmark/core/error.h>
#include <fieldmark/engine/tensor.h>

#include <cstddef>
#include <cstdint>
#include <string>

namespace fieldmark {

/// Why bytes cannot be decoded as an image; decode_image() adds the name and the number of bytes.
struct Undecodable : IoError {
  using IoError::IoError;
};

/// Returns the largest area in pixels that a file of this size may decode to: 2^26 + 4 bytes. A few bytes can
/// state any size, and 8192 x 8192 pixels take a gigabyte.
constexpr std::int64_t max_area(std::size_t bytes) {
  return (std::int64_t{1} << 26) + 4 * static_cast<std::int64_t>(bytes);
}

/// @throws Undecodable if the size is not positive or exceeds max_area()
inline void check_area(std::int64_t width, std::int64_t height, std::size_t bytes) {
  constexpr std::int64_t kMaxSide = std::int64_t{1} << 24;
  if (width < 1 || height < 1 || width > kMaxSide || height > kMaxSide || width * height > max_area(bytes))
    throw Undecodable("an image of " + std::to_string(width) + " x " + std::to_string(height) +
                      " pixels; at most " + std::to_string(max_area(bytes)) +
                      " are read of a file of this size");
}

/// Converts rows of interleaved channels to values in [0, 1].
/// @param rows  of `stride` bytes, each with width * channels values of type T   @param max  represents 1
template <class T>
Tensor<float> from_rows(const std::uint8_t* rows, std::size_t stride, Index height, Index width,
                        Index channels, float max) {
  Tensor<float> image({height, width, channels});
  for (Index y = 0; y < height; ++y) {
    const T* row = reinterpret_cast<const T*>(rows + static_cast<std::size_t>(y) * stride);
    for (Index i = 0; i < width * channels; ++i)
      image[y * width * channels + i] = static_cast<float>(row[i]) / max;
  }
  return image;
}

}  // namespace fieldmark
