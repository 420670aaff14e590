#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark {

/// Average over windows of size x size pixels, side by side. Trailing rows and columns that do not fill a
/// window are dropped: a padded average would darken the border.
/// @param x [N, H, W, C]   @param size  side of a window in pixels, >= 1   @return [N, H / size, W / size, C]
/// @throws ShapeError if x is not rank 4   @throws ValueError if size is below 1
/// Differentiable in: x.
template <class T>
Var<T> avg_pool(Var<T> x, Index size);

/// Average over all pixels of each image; long sums run in double.
/// @param x [N, H, W, C], H and W at least 1   @return [N, C]
/// @throws ShapeError if x is not rank 4 or has images without pixels
/// Differentiable in: x.
template <class T>
Var<T> global_avg_pool(Var<T> x);

}  // namespace fieldmark
