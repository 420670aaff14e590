#pragma once
#include <fieldmark/engine/tensor.h>

namespace fieldmark::distort {

/// Simulates a JPEG round trip with chroma at full size (4:4:4), without an encoder. For each 8 x 8 block of
/// each component, padded by repeating the last row and column:
///   c' = q round(DCT(c) / q),   q = clamp(floor((s base + 50) / 100), 1, 255),
///   s = 5000 / Q below 50, else 200 - 2 Q
/// with the base tables of ITU-T T.81, annex K: luma for Y, chroma for Cb and Cr (JFIF). Components are
/// rounded to 8 bits before the conversion to colours, as in decoders. Entropy coding is lossless and
/// omitted.
/// @param image    [height, width, 3] in [0, 1], at least one pixel; rounded to 8 bits first
/// @param quality  Q, 1 to 100, scaled as libjpeg does
/// @return [height, width, 3], multiples of 1/255
/// @throws ShapeError if it is not such an image   @throws ValueError if the quality is out of range
Tensor<float> jpeg444(const Tensor<float>& image, int quality);

}  // namespace fieldmark::distort
