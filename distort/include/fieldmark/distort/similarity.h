#pragma once
#include <fieldmark/engine/tape.h>

#include <array>

namespace fieldmark::distort {

/// Returns the matrix of affine_warp() for a rotation, a zoom and a shift of the image about its centre.
///   A = R(-angle) / scale,   t = -A shift,   out [a00, a01, t_x, a10, a11, t_y]
/// so an image's point at offset p from the centre moves to scale R(angle) p + shift. The axes are x to the
/// right and y down; a positive angle turns the image counter-clockwise as seen. Sines and cosines within
/// two ulp of 0 are 0: an angle of pi/2 in T gives an exact permutation of the pixels.
/// @param angle  [1] radians   @param scale  [1] > 0, above 1 enlarges   @param shift  [2] (x, y) in pixels
/// @return [6]
/// @throws ShapeError on shapes   @throws ValueError if scale is outside 1e-6 to 1e6 or the angle is not
/// finite
/// Differentiable in: angle, scale, shift.
template <class T>
Var<T> similarity(Var<T> angle, Var<T> scale, Var<T> shift);

/// Overload without a tape, for warp_labels(). @throws ValueError as above
template <class T>
std::array<T, 6> similarity_matrix(T angle, T scale, T shift_x, T shift_y);

}  // namespace fieldmark::distort
