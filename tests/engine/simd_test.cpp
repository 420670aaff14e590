#include <fieldmark/engine/simd.h>

#include <cmath>
#include <limits>

#include "support/catch.h"
#include "support/worst.h"

using namespace simd;

// Runs at the level that tests are compiled for; the kernel tests run every level.
namespace {
float exp_of(float x) {
  float lanes[kLanes<float>];
  store(lanes, exp(broadcast(x)));
  for (float lane : lanes)
    if (!(lane == lanes[0])) return std::numeric_limits<float>::quiet_NaN();
  return lanes[0];
}
}  // namespace

TEST_CASE("simd: what is loaded is what is stored, at any address") {
  float from[kLanes<float> + 1], to[kLanes<float> + 1] = {};
  for (int i = 0; i <= kLanes<float>; ++i) from[i] = static_cast<float>(i) - 2.5f;
  store(to + 1, load(from + 1));
  CHECK(to[0] == 0);
  for (int i = 1; i <= kLanes<float>; ++i) CHECK(to[i] == from[i]);
  store(to, max(min(load(from), broadcast(1.f)), broadcast(-1.f)));
  for (int i = 0; i < kLanes<float>; ++i) CHECK(to[i] == std::fmax(std::fmin(from[i], 1.f), -1.f));
}

TEST_CASE("simd: exp within 2.5e-7 of the exact value over its whole range") {
  double worst = 0;
  for (int i = 0; i <= 200000; ++i) {
    const float x = -87.3f + 175.3f * static_cast<float>(i) / 200000;
    const double want = std::exp(static_cast<double>(x)),
                 error = std::abs(static_cast<double>(exp_of(x)) / want - 1);
    raise_to(worst, error);
  }
  CAPTURE(worst);
  CHECK(worst < 2.5e-7);
  CHECK(exp_of(0) == 1);
}

TEST_CASE("simd: exp is 0 far below its range and stays finite above") {
  const float infinity = std::numeric_limits<float>::infinity();
  CHECK(exp_of(-88) == 0);
  CHECK(exp_of(-infinity) == 0);
  CHECK(exp_of(1000) == exp_of(88));
  CHECK(std::isfinite(exp_of(infinity)));
}
