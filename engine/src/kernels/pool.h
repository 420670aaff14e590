#pragma once
#include <fieldmark/engine/kernel.h>

namespace fieldmark::kernels {

// A row of windows of size x size pixels: x has size rows of `row` elements each, y has `windows` pixels.
struct PoolRow {
  Index windows, size, channels, row;
};

// T is float or double.
FIELDMARK_DECLARE_KERNEL(template <class T> void, pool_row, (const PoolRow& p, const T* x, T* y))
// dx = or += dy / size^2; pixels outside all windows become 0, or stay.
FIELDMARK_DECLARE_KERNEL(template <class T> void, pool_row_backward,
                         (const PoolRow& p, const T* dy, T* dx, bool add))
// sums[c] = sum over pixels of x[pixel, c]; with a `mask`, only where it is positive.
FIELDMARK_DECLARE_KERNEL(template <class T> void, channel_sums,
                         (const T* x, const T* mask, Index pixels, Index channels, double* sums))
// y[pixel, c] = or += row[c].
FIELDMARK_DECLARE_KERNEL(template <class T> void, fill_pixels,
                         (const T* row, Index pixels, Index channels, T* y, bool add))

// A row of overlapping windows: x has `rows` rows of `width` pixels. Windows begin `stride` pixels apart and
// are cut off at the width.
struct MaxPoolRow {
  Index windows, size, stride, rows, width, channels;
};
// y[w, c] = the maximum of window w, and place[w, c] the index of its pixel, u columns + v in a window of
// `columns` pixels a row (null: not wanted).
FIELDMARK_DECLARE_KERNEL(template <class T> void, max_pool_row,
                         (const MaxPoolRow& p, const T* x, T* y, T* place))
// Row u of the windows: dx[pixel, c] += dy[w, c] where that pixel was the largest of window w.
FIELDMARK_DECLARE_KERNEL(template <class T> void, max_pool_row_backward,
                         (const MaxPoolRow& p, Index u, const T* dy, const T* place, T* dx))

}  // namespace fieldmark::kernels
