#pragma once
#include <fieldmark/engine/isa.h>

#include <cstdint>

namespace fieldmark::kernels {

// y[i] = (add ? y[i] : 0) + sum_k weights[k] x[offsets[k] + i] for i in [0, n): one row of a separable
// filter.
FIELDMARK_DECLARE_KERNEL(void, weighted_taps_f32,
                         (float* y, const float* x, const std::int64_t* offsets, const float* weights,
                          std::int64_t taps, std::int64_t n, bool add))
FIELDMARK_DECLARE_KERNEL(void, weighted_taps_f64,
                         (double* y, const double* x, const std::int64_t* offsets, const double* weights,
                          std::int64_t taps, std::int64_t n, bool add))

inline void weighted_taps(float* y, const float* x, const std::int64_t* offsets, const float* weights,
                          std::int64_t taps, std::int64_t n, bool add) {
  FIELDMARK_KERNEL(weighted_taps_f32)(y, x, offsets, weights, taps, n, add);
}
inline void weighted_taps(double* y, const double* x, const std::int64_t* offsets, const double* weights,
                          std::int64_t taps, std::int64_t n, bool add) {
  FIELDMARK_KERNEL(weighted_taps_f64)(y, x, offsets, weights, taps, n, add);
}

}  // namespace fieldmark::kernels
