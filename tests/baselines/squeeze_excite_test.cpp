#include "squeeze_excite.h"

#include <algorithm>
#include <cmath>

#include "support/run_op.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

TEST_CASE("squeeze_excite: scale_channels by a loop") {
  const auto x = uniform({2, 3, 4, 5}, -1, 1, 1), s = uniform({2, 5}, -1, 1, 2);
  const auto run = run_op<double>([](auto&, auto v) { return scale_channels(v[0], v[1]); }, {x, s});
  const auto u = uniform<double>({2, 3, 4, 5}, -1, 1, 99);  // run_op's cotangent
  std::vector<double> ds(10);
  for (Index i = 0; i < 120; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Index n = i / 60, c = i % 5;
    CHECK(run[0][at] == x[i] * s[n * 5 + c]);
    CHECK(run[1][at] == u[i] * s[n * 5 + c]);
    ds[static_cast<std::size_t>(n * 5 + c)] += u[i] * x[i];
  }
  for (std::size_t k = 0; k < 10; ++k) CHECK(run[2][k] == Approx(ds[k]).epsilon(1e-12));
}

TEST_CASE("squeeze_excite: a block whose weights are shut passes its input on") {
  ParamStore<float> store;
  const SqueezeExciteBlock<float> block(store, "b", 16, 1);
  CHECK(store.entry(store.find("b/squeeze/weight")).shape == Shape{16, 2});
  std::ranges::fill(store.values(store.find("b/excite/weight")), 0.f);
  std::ranges::fill(store.values(store.find("b/excite/bias")), -100.f);  // sigmoid 0
  const auto x = uniform<float>({2, 4, 4, 16}, -1, 1, 1);
  const auto run = [&](auto&, auto v) {
    NormPass<float> pass;
    return block(Params<float>(store, nullptr), v[0], pass);
  };
  const auto y = op_values<float>(run, {x});
  for (std::size_t i = 0; i < y.size(); ++i) CHECK(y[i] == std::max(x.data[i], 0.f));
  std::ranges::fill(store.values(store.find("b/excite/bias")), 0.f);
  CHECK(op_values<float>(run, {x}) != y);
}

TEST_CASE("squeeze_excite: threads and errors") {
  expect_same_bits([](auto&, auto v) { return scale_channels(v[0], v[1]); },
                   {uniform<float>({5, 20, 21, 7}, -1, 1, 1), uniform<float>({5, 7}, -1, 1, 2)});
  Tape<float> tape;
  const Tensor<float> x({2, 3, 4, 5}), s({2, 4});
  CHECK_THROWS_WITH(scale_channels(tape.constant(x), tape.constant(s)),
                    "[scale_channels] s: axis 1 must be 5 (channels of x), got shape [2, 4]");
}
