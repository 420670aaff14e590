#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark {

/// How upsample_to() computes a pixel: from the nearest one, or linearly from the four around it.
enum class Interpolation { nearest, bilinear };

/// Repeats every pixel factor x factor times.
/// @param x [N, H, W, C]   @param factor  >= 1   @return [N, H factor, W factor, C]
/// @throws ShapeError if x is not rank 4   @throws ValueError if factor is below 1
/// Differentiable in: x.
template <class T>
Var<T> upsample_nearest(Var<T> x, Index factor);

/// Resamples to a given size. Output pixel i lies at u = (i + 1/2) H / height - 1/2 in units of input pixels,
/// so that the corners of the images coincide. Beyond the outermost centres the border value repeats.
/// `nearest` takes the pixel that contains u. upsample_to() can also shrink, but without a filter: average
/// over areas first.
/// @param x [N, H, W, C]   @param height, width  of the output, >= 0   @return [N, height, width, C]
/// @throws ShapeError if x is not rank 4, or is empty while the output is not
/// @throws ValueError if an extent is negative
/// Differentiable in: x.
template <class T>
Var<T> upsample_to(Var<T> x, Index height, Index width, Interpolation mode = Interpolation::bilinear);

/// Moves blocks of 2 x 2 pixels into channels, so that the next convolution sees a quarter of the pixels.
///   y[n, i, j, (2 a + b) C + c] = x[n, 2 i + a, 2 j + b, c]
/// @param x [N, H, W, C], H and W even   @return [N, H / 2, W / 2, 4 C]
/// @throws ShapeError if x is not rank 4 or an extent is odd
/// Differentiable in: x.
template <class T>
Var<T> space_to_depth(Var<T> x);

}  // namespace fieldmark
