#pragma once
#include <fieldmark/engine/kernel.h>

namespace fieldmark::kernels {

// T is float or double. y[i] = x[i] P(x[i]) with the normal distribution P; then
// dx[i] = or += dy[i] (P(x[i]) + x[i] p(x[i])) with its density p. NaN stays NaN.
FIELDMARK_DECLARE_KERNEL(template <class T> void, gelu_forward, (const T* x, T* y, Index n))
FIELDMARK_DECLARE_KERNEL(template <class T> void, gelu_backward,
                         (const T* x, const T* dy, T* dx, bool add, Index n))

}  // namespace fieldmark::kernels
