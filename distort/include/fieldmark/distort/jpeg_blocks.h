#pragma once
#include <array>

namespace fieldmark::distort {

/// 8 x 8 values in row-major order: levels of one component, or coefficients.
using JpegBlock = std::array<double, 64>;

/// The component to which a quantisation table applies.
enum class JpegComponent { luma, chroma };

/// Returns the quantisation steps: the base table of ITU-T T.81, annex K, scaled as libjpeg does,
///   q = clamp(floor((s base + 50) / 100), 1, 255),   s = 5000 / Q below 50, else 200 - 2 Q.
/// @param quality  Q, 1 to 100   @throws ValueError if it is outside
JpegBlock jpeg_steps(JpegComponent component, int quality);

/// Computes the orthonormal cosine transform of a block (T.81, A.3.3), without level shift.
JpegBlock jpeg_cosines(const JpegBlock& levels);
/// Computes its inverse.
JpegBlock from_jpeg_cosines(const JpegBlock& coefficients);

/// Returns a row of JFIF's colour transform without the offset of 128: Y, Cb or Cr = sum_c row[c] rgb[c].
/// @param component  0 to 2
std::array<double, 3> jpeg_colour_row(int component);

}  // namespace fieldmark::distort
