#pragma once
#include <fieldmark/engine/tensor.h>

#include <cstddef>
#include <span>

namespace fieldmark {

/// Returns the EXIF Orientation of a JPEG or WebP file, which says how to turn it for display.
///   1 unchanged, 2 mirrored left to right, 3 rotated by 180 degrees, 4 mirrored top to bottom, 5 transposed,
///   6 to be rotated clockwise by 90 degrees, 7 transposed along the other diagonal, 8 to be rotated
///   counterclockwise by 90 degrees
/// Source: EXIF 2.32, 4.6.4 A. read_image() returns the pixels as stored, not turned.
/// @param bytes  the whole file   @return 1 to 8; 1 for other formats and files without the tag
int exif_orientation(std::span<const std::byte> bytes);

/// Turns an image as exif_orientation() asks.
/// @param image  [H, W, C]   @param orientation  1 to 8   @return [H, W, C], or [W, H, C] from 5 on
Tensor<float> turned(const Tensor<float>& image, int orientation);

}  // namespace fieldmark
