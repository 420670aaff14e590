#include <fieldmark/engine/ops/operators.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

TEST_CASE("operators: values as of the numbers, in float and double") {
  const auto formula = [](auto a, auto b) {
    return -(a * b + 1.0f) / (b - 3) + 2 / a - (1 - b) * 0.5f + (2 * a) / 4;
  };
  const std::vector<Tensor<double>> in{uniform({7}, 0.5, 2, 1), uniform({7}, 0.5, 2, 2)};
  const auto y = op_values([&](auto&, auto v) { return formula(v[0], v[1]); }, in);
  for (Index i = 0; i < 7; ++i) {
    const double a = in[0][i], b = in[1][i];
    CHECK(y[at(i)] == Approx(-(a * b + 1) / (b - 3) + 2 / a - (1 - b) * 0.5 + 2 * a / 4).epsilon(1e-14));
  }
  const std::vector single{Tensor<float>({2}, {1, 2}), Tensor<float>({1}, 4)};
  CHECK(op_values([](auto&, auto v) { return 1 + v[0] * v[1] + 1; }, single) == std::vector<float>{6, 10});
}

TEST_CASE("operators: gradient") {
  expect_grad(
      [](auto&, auto v) { return -(v[0] * v[1] + 1) / (v[1] - 3.0) + 2 / v[0] - (1 - v[1]) + v[0] / 3; },
      {uniform({4, 3}, 0.5, 2, 1), uniform({3}, 0.5, 2, 2)});
}

TEST_CASE("operators: errors") {
  Tape<double> tape;
  const Tensor<double> a({2, 3}), b({2});
  CHECK_THROWS_WITH(tape.constant(a) + tape.constant(b), Contains("[add] b must broadcast with a"));
  CHECK_THROWS_WITH(tape.constant(a) / 0, "[div] divisor must not be 0");
}
