#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark {

/// Averages over windows of size x size pixels with stride size. Trailing rows and columns that do not fill a
/// window are dropped: a padded average would darken the border.
/// @param x [N, H, W, C]   @param size  side of a window in pixels, 1 to 2147483647
/// @return [N, H / size, W / size, C]
/// @throws ShapeError if x is not rank 4   @throws ValueError if size is out of range
/// Differentiable in: x.
template <class T>
Var<T> avg_pool(Var<T> x, Index size);

/// Averages over all pixels of each image; long sums run in double.
/// @param x [N, H, W, C], H and W at least 1   @return [N, C]
/// @throws ShapeError if x is not rank 4 or has images without pixels
/// Differentiable in: x.
template <class T>
Var<T> global_avg_pool(Var<T> x);

/// Windows of max_pool().
struct MaxPool {
  Index size = 2;          ///< side of a window in pixels, 1 to 2147483647
  Index stride = 2;        ///< pixels from one window to the next, both ways, 1 to 2147483647
  bool ceil_mode = false;  ///< keeps windows that cross the lower or right edge, cut off there
};

/// Takes the maximum of each channel over windows of size x size pixels, which may overlap or leave gaps; NaN
/// if a window has one.
/// @param x [N, H, W, C]   @return [N, H', W', C], H' = (H - size) / stride + 1 rounded down; with ceil_mode
/// rounded up, at least 1, without windows that begin outside
/// @throws ShapeError if x is not rank 4 or has no window
/// @throws ValueError if size or stride is out of range, or a window has over 2^24 pixels of x (double: 2^53)
/// Differentiable in: x, where the maximum of a window is unique; else the gradient goes to the first in
/// reading order.
template <class T>
Var<T> max_pool(Var<T> x, MaxPool windows);

}  // namespace fieldmark
