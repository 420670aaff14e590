#pragma once
#include <cstddef>
#include <span>
#include <string>

namespace fieldmark {

/// How a JPEG file asks to be turned for display, by its EXIF tag Orientation.
///   1 as it is, 2 mirrored left to right, 3 turned by 180 degrees, 4 mirrored top to bottom, 5 transposed,
///   6 to be turned clockwise by 90 degrees, 7 transposed along the other diagonal, 8 to be turned
///   counterclockwise by 90 degrees
/// Source: EXIF 2.32, 4.6.4 A. read_image() gives the pixels as the file holds them, not turned.
/// @param bytes  of the whole file   @return 1 to 8; 1 where the file is no JPEG or does not say
int exif_orientation(std::span<const std::byte> bytes);

/// What is odd about a JPEG file that read_image() passes over: other data behind its end, as of telephones
/// that append a film, or no end marker behind an image that is complete.
/// @param bytes  of the whole file   @return a text for a warning; empty if nothing is, or the file is no
/// JPEG
std::string jpeg_oddity(std::span<const std::byte> bytes);

}  // namespace fieldmark
