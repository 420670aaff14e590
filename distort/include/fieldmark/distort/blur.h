#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark::distort {

/// Separable Gaussian blur; the image's edge pixels continue outside it.
///   y(i, j) = sum_kl g_k g_l x(i + k, j + l),   g_k = exp(-k^2 / 2 sigma^2) / sum,   |k| <= r = max(1,
///   ceil(4 sigma))
/// Constant images stay constant; sigma to 0 is the exact identity.
/// @param x      [height, width, channels]
/// @param sigma  [1] standard deviation in pixels, 0 to 1000
/// @return [height, width, channels]
/// @throws ShapeError if x is not an image or sigma not [1]   @throws ValueError on sigma
/// Differentiable in: x, sigma. Jumps by up to 3e-4 of the range where 4 sigma is an integer, as r grows.
template <class T>
Var<T> blur(Var<T> x, Var<T> sigma);

}  // namespace fieldmark::distort
