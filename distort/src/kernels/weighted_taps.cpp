#include <fieldmark/engine/simd.h>

#include <cstdint>

namespace {

using std::int64_t;

// Four registers at a time: the taps' loop is bound by loads, and y is written once.
template <class T>
void run(T* y, const T* x, const int64_t* offsets, const T* weights, int64_t taps, int64_t n, bool add) {
  constexpr int64_t kStep = simd::kLanes<T>;
  int64_t i = 0;
  for (; i + 4 * kStep <= n; i += 4 * kStep) {
    simd::Vec<T> sum[4] = {};
    for (int s = 0; s < 4 && add; ++s) sum[s] = simd::load(y + i + s * kStep);
    for (int64_t k = 0; k < taps; ++k) {
      const simd::Vec<T> w = simd::broadcast(weights[k]);
      const T* p = x + offsets[k] + i;
      for (int s = 0; s < 4; ++s) sum[s] += w * simd::load(p + s * kStep);
    }
    for (int s = 0; s < 4; ++s) simd::store(y + i + s * kStep, sum[s]);
  }
  for (; i < n; ++i) {
    T sum = add ? y[i] : T(0);
    for (int64_t k = 0; k < taps; ++k) sum += weights[k] * x[offsets[k] + i];
    y[i] = sum;
  }
}

}  // namespace

namespace fieldmark::kernels::FIELDMARK_ISA_NS {

void weighted_taps_f32(float* y, const float* x, const int64_t* offsets, const float* weights, int64_t taps,
                       int64_t n, bool add) {
  run(y, x, offsets, weights, taps, n, add);
}
void weighted_taps_f64(double* y, const double* x, const int64_t* offsets, const double* weights,
                       int64_t taps, int64_t n, bool add) {
  run(y, x, offsets, weights, taps, n, add);
}

}  // namespace fieldmark::kernels::FIELDMARK_ISA_NS
