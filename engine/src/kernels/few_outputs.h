#pragma once
#include <fieldmark/engine/kernel.h>

namespace fieldmark::kernels {

/// One row of a convolution with few outputs. Lanes hold pixels, because the outputs would leave most of a
/// vector empty. x holds one plane of pixels for each row of the window and each channel; up to
/// round_up(pixels, lanes) + window - 1 elements of a plane are read.
template <class T>
struct FewOutputs {
  Index pixels = 0, channels = 0;
  Index outputs = 0;     ///< 1 to most_few_outputs()
  Index window = 0;      ///< K, pixels
  const T* x = nullptr;  ///< element [u, c, j] is at u row + c plane + j
  Index row = 0, plane = 0;
  const T* w = nullptr;     ///< [K, K, channels, outputs]
  const T* bias = nullptr;  ///< [outputs] or null; not with accumulate
  bool accumulate = false, relu = false;
  T* y = nullptr;  ///< [pixels, outputs]
};

/// Returns the largest number of outputs that few_outputs() takes; 0: none.
FIELDMARK_DECLARE_KERNEL(template <class T> Index, most_few_outputs, ())

/// out[c plane + j] = x[j, c] of x [pixels, channels], or 0 where the mask (laid out like x; null: none) is
/// not positive.
FIELDMARK_DECLARE_KERNEL(template <class T> void, pixel_planes,
                         (const T* x, const T* mask, Index pixels, Index channels, Index plane, T* out))

/// y[j, o] = act(start + sum over u, v, c of x[u, c, j + v] w[u, v, c, o]), where start is y's old value, the
/// bias or 0. The order of the sums, and so every bit, is that of gemm().
FIELDMARK_DECLARE_KERNEL(template <class T> void, few_outputs, (const FewOutputs<T>& f))

}  // namespace fieldmark::kernels
