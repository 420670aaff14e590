#include "kernels/fma_peak.h"

#include "support/each_isa.h"

using namespace fieldmark;
using namespace fieldmark::kernels;

TEST_CASE("kernels/fma_peak: counts two operations a lane of every chain and round") {
  each_isa([] {
    const double lanes = isa() == Isa::v4 ? 16 : isa() == Isa::v3 ? 8 : 4;
    CHECK(FIELDMARK_KERNEL(fma_peak_f32)(0) == 0);
    CHECK(FIELDMARK_KERNEL(fma_peak_f32)(1000) == 1000 * 2 * 12 * lanes);
  });
}
