#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark::distort {

/// Applies a separable Gaussian blur; the edge pixels of the image extend outwards.
///   y(i, j) = sum_kl g_k g_l x(i + k, j + l),
///   g_k = exp(-k^2 / 2 sigma^2) / sum,   |k| <= r = max(1, ceil(4 sigma))
/// Constant images stay constant; as sigma goes to 0, the blur becomes the exact identity.
/// @param x      [height, width, channels]
/// @param sigma  [1] standard deviation in pixels, 0 to 1000
/// @return [height, width, channels]
/// @throws ShapeError if x is not an image or sigma not [1]   @throws ValueError if sigma is out of range
/// Differentiable in: x, sigma. Jumps by up to 3e-4 of the range where 4 sigma is an integer, as r grows.
template <class T>
Var<T> blur(Var<T> x, Var<T> sigma);

}  // namespace fieldmark::distort
