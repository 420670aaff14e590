#pragma once
#include <fieldmark/engine/kernel.h>

namespace fieldmark::kernels {

// T is float or double. y[i] = (add ? y[i] : 0) + sum_k weights[k] x[offsets[k] + i] for i in [0, n): one row
// of a separable filter.
FIELDMARK_DECLARE_KERNEL(template <class T> void, weighted_taps,
                         (T * y, const T* x, const Index* offsets, const T* weights, Index taps, Index n,
                          bool add))

template <class T>
void weighted_taps(T* y, const T* x, const Index* offsets, const T* weights, Index taps, Index n, bool add) {
  FIELDMARK_KERNEL(weighted_taps<T>)(y, x, offsets, weights, taps, n, add);
}

}  // namespace fieldmark::kernels
