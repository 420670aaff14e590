#pragma once
#include <fieldmark/engine/kernel.h>

#include <cstdint>

namespace fieldmark::kernels {

// Multiplies and adds in registers only, with enough independent chains to hide the latency, so that only
// arithmetic limits the speed. Returns the number of floating-point operations in `rounds` rounds.
FIELDMARK_DECLARE_KERNEL(double, fma_peak_f32, (std::int64_t rounds))

}  // namespace fieldmark::kernels
