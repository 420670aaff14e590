#pragma once
#include <fieldmark/engine/kernel.h>

#include <cstdint>

namespace fieldmark::kernels {

/// Scalars of one step, the same for every entry.
template <class T>
struct AdamScalars {
  T beta1, beta2, eps;
  T step;    ///< lr / (1 - beta1^t)
  T root;    ///< 1 / sqrt(1 - beta2^t)
  T shrink;  ///< 1 - lr weight_decay
  bool skip_zero, zero_grads;
};

/// Makes one pass over n entries: reads and writes x, m and v, reads g, and clears g if zero_grads.
FIELDMARK_DECLARE_KERNEL(void, adam_f32,
                         (float* x, float* g, float* m, float* v, std::int64_t n,
                          const AdamScalars<float>& s))
FIELDMARK_DECLARE_KERNEL(void, adam_f64,
                         (double* x, double* g, double* m, double* v, std::int64_t n,
                          const AdamScalars<double>& s))

}  // namespace fieldmark::kernels
