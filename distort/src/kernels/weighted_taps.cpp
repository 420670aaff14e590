#include "kernels/weighted_taps.h"

#include <fieldmark/engine/simd.h>

namespace fieldmark::kernels::FIELDMARK_ISA_NS {

// Processes four registers at a time: loads bound the loop over taps, and y is written once.
template <class T>
void weighted_taps(T* y, const T* x, const Index* offsets, const T* weights, Index taps, Index n, bool add) {
  constexpr Index kStep = simd::kLanes<T>;
  Index i = 0;
  for (; i + 4 * kStep <= n; i += 4 * kStep) {
    simd::Vec<T> sum[4] = {};
    for (int s = 0; s < 4 && add; ++s) sum[s] = simd::load(y + i + s * kStep);
    for (Index k = 0; k < taps; ++k) {
      const simd::Vec<T> w = simd::broadcast(weights[k]);
      const T* p = x + offsets[k] + i;
      for (int s = 0; s < 4; ++s) sum[s] += w * simd::load(p + s * kStep);
    }
    for (int s = 0; s < 4; ++s) simd::store(y + i + s * kStep, sum[s]);
  }
  for (; i < n; ++i) {
    T sum = add ? y[i] : T(0);
    for (Index k = 0; k < taps; ++k) sum += weights[k] * x[offsets[k] + i];
    y[i] = sum;
  }
}

template void weighted_taps(float*, const float*, const Index*, const float*, Index, Index, bool);
template void weighted_taps(double*, const double*, const Index*, const double*, Index, Index, bool);

}  // namespace fieldmark::kernels::FIELDMARK_ISA_NS
