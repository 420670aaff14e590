#pragma once
#include <fieldmark/engine/tensor.h>

#include <cstddef>
#include <span>

namespace fieldmark {

/// How a JPEG or WebP file asks to be turned for display, by its EXIF tag Orientation.
///   1 as it is, 2 mirrored left to right, 3 turned by 180 degrees, 4 mirrored top to bottom, 5 transposed,
///   6 to be turned clockwise by 90 degrees, 7 transposed along the other diagonal, 8 to be turned
///   counterclockwise by 90 degrees
/// Source: EXIF 2.32, 4.6.4 A. read_image() gives the pixels of these files as they are held, not turned.
/// @param bytes  of the whole file   @return 1 to 8; 1 where the file is of another format or does not say
int exif_orientation(std::span<const std::byte> bytes);

/// An image turned as exif_orientation() asks for it.
/// @param image  [H, W, C]   @param orientation  1 to 8   @return [H, W, C], from 5 on [W, H, C]
Tensor<float> turned(const Tensor<float>& image, int orientation);

}  // namespace fieldmark
