#include "kernels/chain.h"

#include <fieldmark/engine/aligned.h>
#include <fieldmark/engine/chain.h>

#include "support/catch.h"
#include "support/each_isa.h"
#include "support/random.h"

namespace fieldmark::kernels {

TEST_CASE("kernels/chain: every length at an odd offset, and past the caches, and nothing outside is touched") {
  Chain chain(2);
  chain.finish(chain.input(0) * chain.input(1) + 2.0 * chain.input(0));
  each_isa([&] {
    for (const auto& [large, from] : {std::pair{false, 1u}, std::pair{true, 16u}})
      for (std::int64_t n = 0; n <= 530; n = n < 70 ? n + 1 : n + 51) {
        CAPTURE(n, large);
        const auto size = static_cast<std::size_t>(n);
        const auto a = uniform<float>({n + from}, -1, 1, 1), b = uniform<float>({n + from}, -1, 1, 2),
                   dy = uniform<float>({n + from}, -1, 1, 3);
        AlignedVector<float> y(size + from + 1, 7.f), da = y, db = y;
        const float* inputs[] = {a.data.data() + from, b.data.data() + from};
        float* dinputs[] = {da.data() + from, db.data() + from};
        const bool add[] = {false, true};
        FIELDMARK_KERNEL(chain_forward<float>)(chain.steps(), inputs, y.data() + from, n, large);
        FIELDMARK_KERNEL(chain_backward<float>)
        (chain.steps(), inputs, dy.data.data() + from, dinputs, add, n, large);
        for (const auto* array : {&y, &da, &db}) CHECK(((*array)[from - 1] == 7 && array->back() == 7));
        for (std::size_t i = from; i < size + from; ++i) {
          CHECK(std::abs(y[i] - (a.data[i] * b.data[i] + 2 * a.data[i])) <= 1e-6f);
          CHECK(std::abs(da[i] - dy.data[i] * (b.data[i] + 2)) <= 1e-6f);
          CHECK(std::abs(db[i] - (7 + dy.data[i] * a.data[i])) <= 2e-6f);
        }
      }
  });
}

TEST_CASE("kernels/chain: a gradient that is not wanted has no memory") {
  Chain chain(2);
  chain.finish(chain.input(0) / chain.input(1));
  const double a[] = {6}, b[] = {2}, dy[] = {1};
  const double* inputs[] = {a, b};
  double da = 1, *dinputs[] = {&da, nullptr};
  const bool add[] = {true, false};
  FIELDMARK_KERNEL(chain_backward<double>)(chain.steps(), inputs, dy, dinputs, add, 1, false);
  CHECK(da == 1.5);
}

}  // namespace fieldmark::kernels
