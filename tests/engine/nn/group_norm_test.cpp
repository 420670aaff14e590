#include <fieldmark/engine/nn/group_norm.h>

#include "support/expect_grad.h"

using namespace fieldmark;

TEST_CASE("nn/group_norm: starts as plain normalisation") {
  ParamStore<double> store;
  const GroupNorm<double> norm(store, "head/norm", 4, {.groups = 2});
  CHECK(store.entry(store.find("head/norm/gamma")).shape == Shape{4});
  Tape<double> tape;
  const auto x = uniform({2, 3, 3, 4}, -1, 5, 1);
  const auto y = norm(Params<double>(store), tape.constant(x));
  double sum = 0, squares = 0;
  for (Index p = 0; p < 9; ++p)
    for (Index c = 0; c < 2; ++c) {
      sum += y.value()[p * 4 + c];
      squares += y.value()[p * 4 + c] * y.value()[p * 4 + c];
    }
  CHECK(std::abs(sum) < 1e-13);
  CHECK(std::abs(squares / 18 - 1) < 1e-4);  // eps
}

TEST_CASE("nn/group_norm: gradient") {
  ParamStore<double> store;
  const GroupNorm<double> norm(store, "n", 4, {.groups = 2});
  const Tensor<double> inputs[] = {uniform({2, 2, 3, 4}, -1, 1, 1)};
  const auto report = gradcheck_module(
      [&](Tape<double>&, const Params<double>& p, std::span<const Var<double>> v) { return norm(p, v[0]); },
      store, inputs);
  INFO(report.table);
  CHECK(report.ok);
}

TEST_CASE("nn/group_norm: errors") {
  ParamStore<float> store;
  CHECK_THROWS_WITH(
      GroupNorm<float>(store, "n", 6, {.groups = 4}),
      "[GroupNorm] channels must be at least 1 and a multiple of groups, got 6 channels and 4 groups");
  CHECK_THROWS_AS(GroupNorm<float>(store, "n", 0, {.groups = 4}), ValueError);
}
