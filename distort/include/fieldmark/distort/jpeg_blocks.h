#pragma once
#include <array>

namespace fieldmark::distort {

/// 8 x 8 values, row by row: levels of one component, or coefficients.
using JpegBlock = std::array<double, 64>;

/// The component of a quantisation table.
enum class JpegComponent { luma, chroma };

/// Quantisation steps of the coefficients: the base table of ITU-T T.81, annex K, scaled as libjpeg does,
///   q = clamp(floor((s base + 50) / 100), 1, 255),   s = 5000 / Q below 50, else 200 - 2 Q.
/// @param quality  Q, 1 to 100   @throws ValueError if it is outside
JpegBlock jpeg_steps(JpegComponent component, int quality);

/// The orthonormal cosine transform of a block (T.81, A.3.3), without level shift.
JpegBlock jpeg_cosines(const JpegBlock& levels);
/// Its inverse.
JpegBlock from_jpeg_cosines(const JpegBlock& coefficients);

/// Row a of the colour transform of JFIF without its offset of 128: Y, Cb or Cr = sum_c row[c] rgb[c].
/// @param component  0 to 2
std::array<double, 3> jpeg_colour_row(int component);

}  // namespace fieldmark::distort
