#include "kernels/adam.h"

#include <cstring>

namespace fieldmark::kernels {
namespace {

[[gnu::always_inline]] inline float root(float x) { return __builtin_sqrtf(x); }
[[gnu::always_inline]] inline double root(double x) { return __builtin_sqrt(x); }

// A plain loop that the compiler vectorises. It loads and stores everything, so that skipping is a blend and
// not a branch.
template <bool kSkip, bool kClear, class T>
[[gnu::always_inline]] inline void run(T* __restrict x, T* __restrict g, T* __restrict m, T* __restrict v,
                                       std::int64_t n, const AdamScalars<T>& scalars) {
  const AdamScalars<T> s = scalars;
  const T one_less1 = 1 - s.beta1, one_less2 = 1 - s.beta2;
#pragma GCC ivdep  // for single lines, overlap checks would cost as much as the work
  for (std::int64_t i = 0; i < n; ++i) {
    const T grad = g[i], m0 = m[i], v0 = v[i], x0 = x[i];
    const T m1 = s.beta1 * m0 + one_less1 * grad;
    const T v1 = s.beta2 * v0 + one_less2 * (grad * grad);
    const T x1 = s.shrink * x0 - s.step * m1 / (root(v1) * s.root + s.eps);
    const bool keep = kSkip && grad == 0;
    m[i] = keep ? m0 : m1;
    v[i] = keep ? v0 : v1;
    x[i] = keep ? x0 : x1;
    if constexpr (kClear) g[i] = 0;
  }
}

constexpr std::int64_t kLine = 16;  // numbers skipped together: a cache line of floats

// A skipped line of zeros costs only the read of its gradients, not of three more arrays: a step touches few
// lines of a hash table.
template <bool kClear, class T>
[[gnu::always_inline]] inline void run_sparse(T* x, T* g, T* m, T* v, std::int64_t n,
                                              const AdamScalars<T>& s) {
  // Compares bits: float comparisons compiled to a scalar loop that took longer than the updates. A line of
  // -0 counts as work and changes nothing.
  const auto any = [g](std::int64_t at) {
    std::uint64_t found = 0, word;
    for (int k = 0; k < kLine; k += 8 / static_cast<int>(sizeof(T))) {
      std::memcpy(&word, g + at + k, sizeof word);
      found |= word;
    }
    return found != 0;
  };
  std::int64_t i = 0;
  for (; i + kLine <= n; i += kLine) {
    // Prefetches the other arrays some lines ahead: where lines are skipped, the hardware sees no stream.
    const std::int64_t ahead = i + 12 * kLine;
    if (ahead + kLine <= n && any(ahead)) {
      __builtin_prefetch(x + ahead, 1);
      __builtin_prefetch(m + ahead, 1);
      __builtin_prefetch(v + ahead, 1);
    }
    if (any(i)) run<true, kClear>(x + i, g + i, m + i, v + i, kLine, s);
  }
  run<true, kClear>(x + i, g + i, m + i, v + i, n - i, s);
}

template <class T>
[[gnu::always_inline]] inline void choose(T* x, T* g, T* m, T* v, std::int64_t n, const AdamScalars<T>& s) {
  if (s.skip_zero && s.zero_grads) return run_sparse<true>(x, g, m, v, n, s);
  if (s.skip_zero) return run_sparse<false>(x, g, m, v, n, s);
  if (s.zero_grads) return run<false, true>(x, g, m, v, n, s);
  run<false, false>(x, g, m, v, n, s);
}

}  // namespace

namespace FIELDMARK_ISA_NS {

void adam_f32(float* x, float* g, float* m, float* v, std::int64_t n, const AdamScalars<float>& s) {
  choose(x, g, m, v, n, s);
}
void adam_f64(double* x, double* g, double* m, double* v, std::int64_t n, const AdamScalars<double>& s) {
  choose(x, g, m, v, n, s);
}

}  // namespace FIELDMARK_ISA_NS
}  // namespace fieldmark::kernels
