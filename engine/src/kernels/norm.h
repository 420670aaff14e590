#pragma once
#include <fieldmark/engine/kernel.h>

namespace fieldmark::kernels {

// One number per channel: y = (x - mean) gain + shift, then max(y, 0) if relu.
template <class T>
struct Affine {
  const T *mean, *gain, *shift;
  bool relu;
};

// T is float or double; x, y, dy, dx are [pixels, channels]; per-channel sums are kept in double.
// Computes the mean and the sum of squared deviations from it.
FIELDMARK_DECLARE_KERNEL(template <class T> void, channel_moments,
                         (const T* x, Index pixels, Index channels, double* mean, double* m2))
FIELDMARK_DECLARE_KERNEL(template <class T> void, normalise,
                         (const T* x, T* y, Index pixels, Index channels, const Affine<T>& a))
// sums[c] = sum g, moments[c] = sum g (x - mean), where g = dy, or 0 where the ReLU is flat.
FIELDMARK_DECLARE_KERNEL(template <class T> void, norm_sums,
                         (const T* x, const T* dy, Index pixels, Index channels, const Affine<T>& a,
                          double* sums, double* moments))
// dx = or += g gain - offset - (x - mean) slope.
FIELDMARK_DECLARE_KERNEL(template <class T> void, norm_gradient,
                         (const T* x, const T* dy, T* dx, Index pixels, Index channels, const Affine<T>& a,
                          const T* offset, const T* slope, bool add))

}  // namespace fieldmark::kernels
