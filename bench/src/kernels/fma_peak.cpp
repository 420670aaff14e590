#include "kernels/fma_peak.h"

#include <fieldmark/engine/simd.h>

namespace fieldmark::kernels::FIELDMARK_ISA_NS {
namespace {

constexpr int kChains = 12;  // two units of latency 4 want 8; of 16 registers two hold the factors

// Written as instructions: from a loop in C++ the compiler took the factors out and half of the work with
// them.
[[gnu::always_inline]] inline void multiply_add(simd::Vec<float>& sum, simd::Vec<float> x,
                                                simd::Vec<float> y) {
#if defined(__FMA__)
  asm volatile("vfmadd231ps %2, %1, %0" : "+x"(sum) : "x"(x), "x"(y));
#else
  asm volatile("mulps %1, %0\n\taddps %2, %0" : "+x"(sum) : "x"(x), "x"(y));
#endif
}

}  // namespace

double fma_peak_f32(std::int64_t rounds) {
  simd::Vec<float> sums[kChains], x = simd::broadcast(0.5f), y = simd::broadcast(1e-3f);
  for (auto& s : sums) s = x;
  for (std::int64_t r = 0; r < rounds; ++r)
    for (auto& s : sums) multiply_add(s, x, y);
  simd::Vec<float> total{};
  for (const auto& s : sums) total += s;
  asm volatile("" : : "x"(total));
  return 2.0 * static_cast<double>(rounds) * kChains * simd::kLanes<float>;
}

}  // namespace fieldmark::kernels::FIELDMARK_ISA_NS
