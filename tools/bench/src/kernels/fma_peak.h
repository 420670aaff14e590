#pragma once
#include <fieldmark/engine/kernel.h>

#include <cstdint>

namespace fieldmark::kernels {

// Multiplies and adds on registers only, as many at a time as hide their latency: nothing but arithmetic
// limits it. Returns the floating-point operations done in `rounds` of it.
FIELDMARK_DECLARE_KERNEL(double, fma_peak_f32, (std::int64_t rounds))

}  // namespace fieldmark::kernels
