#include "kernels/fma_peak.h"

#include <fieldmark/engine/simd.h>

namespace fieldmark::kernels::FIELDMARK_ISA_NS {
namespace {

constexpr int kChains = 12;  // two units of latency 4 need 8; of 16 registers, two hold the factors

// Inline assembly: in a C++ loop, the compiler hoisted the factors and half of the work with them.
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
  const simd::Vec<float> x = simd::broadcast(0.5f), y = simd::broadcast(1e-3f);
  // Twelve variables instead of an array: array elements stayed in memory, and the rate fell to a third.
  simd::Vec<float> a = x, b = x, c = x, d = x, e = x, f = x, g = x, h = x, i = x, j = x, k = x, l = x;
  for (std::int64_t r = 0; r < rounds; ++r) {
    multiply_add(a, x, y), multiply_add(b, x, y), multiply_add(c, x, y), multiply_add(d, x, y);
    multiply_add(e, x, y), multiply_add(f, x, y), multiply_add(g, x, y), multiply_add(h, x, y);
    multiply_add(i, x, y), multiply_add(j, x, y), multiply_add(k, x, y), multiply_add(l, x, y);
  }
  asm volatile("" : : "x"(a + b + c + d + e + f + g + h + i + j + k + l));
  return 2.0 * static_cast<double>(rounds) * kChains * simd::kLanes<float>;
}

}  // namespace fieldmark::kernels::FIELDMARK_ISA_NS
