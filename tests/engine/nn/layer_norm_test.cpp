#include <fieldmark/engine/nn/layer_norm.h>

#include "support/expect_grad.h"

using namespace fieldmark;

TEST_CASE("nn/layer_norm: starts as plain normalisation of each row") {
  ParamStore<double> store;
  const LayerNorm<double> norm(store, "block/norm", 5);
  CHECK(store.entry(store.find("block/norm/gamma")).shape == Shape{5});
  Tape<double> tape;
  const auto x = uniform({2, 3, 5}, -1, 5, 1);
  const auto y = norm(Params<double>(store), tape.constant(x));
  for (Index r = 0; r < 6; ++r) {
    double sum = 0, squares = 0;
    for (Index c = 0; c < 5; ++c) {
      sum += y.value()[5 * r + c];
      squares += y.value()[5 * r + c] * y.value()[5 * r + c];
    }
    CHECK(std::abs(sum) < 1e-13);
    CHECK(std::abs(squares / 5 - 1) < 1e-4);  // eps
  }
  store.values(store.find("block/norm/beta"))[4] = 100;
  CHECK(norm(Params<double>(store), tape.constant(x)).value()[9] == y.value()[9] + 100);
}

TEST_CASE("nn/layer_norm: gradient") {
  ParamStore<double> store;
  const LayerNorm<double> norm(store, "n", 4, 0.1);
  const Tensor<double> inputs[] = {uniform({3, 4}, -1, 1, 1)};
  const auto report = gradcheck_module(
      [&](Tape<double>&, const Params<double>& p, std::span<const Var<double>> v) { return norm(p, v[0]); },
      store, inputs);
  INFO(report.table);
  CHECK(report.ok);
}

TEST_CASE("nn/layer_norm: errors") {
  ParamStore<float> store;
  CHECK_THROWS_WITH(LayerNorm<float>(store, "n", 0), "[LayerNorm] channels must be at least 1, got 0");
  CHECK_THROWS_WITH(LayerNorm<float>(store, "n", 4, 0), Contains("[LayerNorm] eps must be above 0, got 0"));
}
