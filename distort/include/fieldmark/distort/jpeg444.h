#pragma once
#include <fieldmark/engine/tensor.h>

namespace fieldmark::distort {

/// JPEG round trip with chroma at full size (4:4:4), which the encoder of jpeg_round_trip() has at its best
/// qualities only. For each 8 x 8 block of each component, the last row and column repeated to fill it:
///   c' = q round(DCT(c) / q),   q = clamp(floor((s base + 50) / 100), 1, 255),   s = 5000 / Q below 50, else
///   200 - 2 Q
/// with the base tables of ITU-T T.81, annex K, luma's for Y and chroma's for Cb and Cr (JFIF). Components
/// are rounded to 8 bits before the conversion to colours, as in decoders. Entropy coding is lossless and
/// left out.
/// @param image    [height, width, 3] in [0, 1], at least one pixel; rounded to 8 bits first
/// @param quality  Q, 1 to 100, scaled as libjpeg does
/// @return [height, width, 3], multiples of 1/255
/// @throws ShapeError if it is no such image   @throws ValueError if the quality is outside
Tensor<float> jpeg444(const Tensor<float>& image, int quality);

}  // namespace fieldmark::distort
