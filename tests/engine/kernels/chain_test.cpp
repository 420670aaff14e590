#include "kernels/chain.h"

#include <fieldmark/engine/aligned.h>
#include <fieldmark/engine/chain.h>

#include "support/catch.h"
#include "support/each_isa.h"
#include "support/random.h"

namespace fieldmark::kernels {

TEST_CASE(
    "kernels/chain: every length at an odd offset, and past the caches, and nothing outside is touched") {
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

// y = t^2 + (x + x), t = (x - w) + (x + b): sums pass their gradient on, x has its gradient in four parts.
TEST_CASE("kernels/chain: gradients in several parts, through sums and differences") {
  Chain chain(3);
  const auto x = chain.input(0), w = chain.input(1), b = chain.input(2), t = (x - w) + (x + b);
  chain.finish(t * t + (x + x));
  constexpr std::size_t n = 300, from = 16;
  each_isa([&] {
    for (const bool large : {false, true})
      for (const bool add_x : {false, true}) {
        CAPTURE(large, add_x);
        std::vector<Tensor<float>> values;
        for (const int seed : {1, 2, 3, 4}) values.push_back(uniform<float>({from + n}, -1, 1, seed));
        std::vector<AlignedVector<float>> grads(3, AlignedVector<float>(from + n, 7.f));
        const float* inputs[3];
        float* dinputs[3];
        for (std::size_t k = 0; k < 3; ++k)
          inputs[k] = values[k].data.data() + from, dinputs[k] = grads[k].data() + from;
        const bool add[] = {add_x, false, false};
        FIELDMARK_KERNEL(chain_backward<float>)
        (chain.steps(), inputs, values[3].data.data() + from, dinputs, add, n, large);
        for (std::size_t i = 0; i < n; ++i) {
          const double dt = 2.0 * (2.0 * inputs[0][i] - inputs[1][i] + inputs[2][i]),
                       dy = values[3].data[from + i];
          CHECK(std::abs(dinputs[0][i] - ((add_x ? 7 : 0) + dy * (2 * dt + 2))) <= 1e-5);
          CHECK(std::abs(dinputs[1][i] + dy * dt) <= 4e-6);
          CHECK(std::abs(dinputs[2][i] - dy * dt) <= 4e-6);
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
