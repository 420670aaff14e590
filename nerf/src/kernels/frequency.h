#pragma once
#include <fieldmark/engine/kernel.h>

#include <cstdint>

namespace fieldmark::kernels {

// y[i, (2 b + 0) * dims + a] = sin(2^b pi x[i, a]), y[i, (2 b + 1) * dims + a] = cos(2^b pi x[i, a]), x [n,
// dims].
FIELDMARK_DECLARE_KERNEL(template <class T> void, frequency_forward,
                         (const T* x, std::int64_t n, int dims, int bands, T* y))

}  // namespace fieldmark::kernels
