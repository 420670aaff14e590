#include "kernels/weighted_taps.h"

#include <fieldmark/engine/isa.h>

#include <cmath>
#include <vector>

#include "support/catch.h"
#include "support/random.h"
#include "support/worst.h"

using namespace fieldmark;

namespace {
// Returns the worst error against long double over every row length from 0 to 130, relative to the sum of the
// absolute terms.
template <class T>
double worst_error(bool add) {
  const std::vector<Index> offsets{7, 0, 131, 40, 3};
  const auto x = uniform<T>({300}, -1, 1, 1), weights = uniform<T>({5}, -1, 1, 2),
             start = uniform<T>({130}, -1, 1, 3);
  double worst = 0;
  for (Index n = 0; n <= 130; ++n) {
    for (Index taps : {0, 1, 5}) {
      std::vector<T> y = start.data;
      kernels::weighted_taps(y.data(), x.data.data(), offsets.data(), weights.data.data(), taps, n, add);
      for (Index i = 0; i < 130; ++i) {
        long double want = add || i >= n ? start[i] : 0, size = 1e-30L + std::abs(want);
        for (Index k = 0; k < taps && i < n; ++k) {
          const long double term =
              static_cast<long double>(weights[k]) * x[offsets[static_cast<std::size_t>(k)] + i];
          want += term;
          size += std::abs(term);
        }
        raise_to(worst, static_cast<double>(std::abs(y[static_cast<std::size_t>(i)] - want) / size));
      }
    }
  }
  return worst;
}
}  // namespace

TEST_CASE("weighted_taps: every length on every instruction set, within 3 ulp of long double") {
  for (Isa level : {Isa::v2, Isa::v3, Isa::v4}) {
    if (level > isa_supported()) continue;
    const ScopedIsa scope(level);
    INFO("isa " << isa_name());
    for (bool add : {false, true}) {
      CHECK(worst_error<float>(add) < 3 * 1.2e-7);
      CHECK(worst_error<double>(add) < 3 * 2.3e-16);
    }
  }
}
