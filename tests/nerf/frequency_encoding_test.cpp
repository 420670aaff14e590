#include <fieldmark/nerf/frequency_encoding.h>

#include <cmath>
#include <numbers>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
auto frequency_op(int bands) {
  return [bands](auto&, auto v) { return frequency_encoding(v[0], bands); };
}
}  // namespace

TEST_CASE("frequency_encoding: sin then cos of each band for all dimensions") {
  const Tensor<double> x(Shape{2, 2}, {0.1, -0.3, 0.7, 1.9});
  const auto y = op_values<double>(frequency_op(3), {x});
  REQUIRE(y.size() == 24);
  for (std::size_t i = 0; i < 2; ++i)
    for (std::size_t b = 0; b < 3; ++b)
      for (std::size_t a = 0; a < 2; ++a) {
        const double angle = std::ldexp(std::numbers::pi * x.data[2 * i + a], static_cast<int>(b));
        CHECK(std::abs(y[12 * i + 4 * b + a] - std::sin(angle)) < 1e-14);
        CHECK(std::abs(y[12 * i + 4 * b + 2 + a] - std::cos(angle)) < 1e-14);
      }
}

TEST_CASE("frequency_encoding: gradient") {
  // Finite-difference steps must be small against the period of the highest band: 2^3 pi, 2^9 pi per unit.
  for (const Index n : {0, 1, 4})
    for (const Index dims : {1, 3})
      expect_grad(frequency_op(4), {uniform({n, dims}, -1, 1, 2)}, {.step = 0.3});
  expect_grad(frequency_op(10), {uniform({3, 3}, -1, 1, 3)}, {.rtol = 1e-6, .step = 1e-2});
}

TEST_CASE("frequency_encoding: float within 3e-7 of double, gradients relative to the largest") {
  CHECK(float_error(frequency_op(10), {uniform<float>({300, 3}, -1, 1, 4)}) < 3e-7);
  CHECK(float_error(frequency_op(16), {uniform<float>({300, 3}, 1000, 1001, 5)}) < 3e-7);
  CHECK(float_error_to_130(frequency_op(5), [](Index e) {
          return std::vector{uniform<float>({e, 3}, -1, 1, 6)};
        }) < 3e-7);
}

TEST_CASE("frequency_encoding: errors name argument and value") {
  Tape<float> t;
  const Tensor<float> row(Shape{3}), wide(Shape{2, 5}), ok(Shape{2, 3});
  CHECK_THROWS_WITH(frequency_encoding(t.constant(row), 4),
                    "[frequency_encoding] x must have rank 2 [N, D], got shape [3]");
  CHECK_THROWS_WITH(frequency_encoding(t.constant(wide), 4),
                    "[frequency_encoding] x: axis 1 must be 1 to 4, got shape [2, 5]");
  CHECK_THROWS_WITH(frequency_encoding(t.constant(ok), 0),
                    "[frequency_encoding] bands must be 1 to 20, got 0");
  CHECK_THROWS_WITH(frequency_encoding(t.constant(ok), 21),
                    "[frequency_encoding] bands must be 1 to 20, got 21");
}

TEST_CASE("frequency_encoding: the same bits for one and two threads") {
  expect_same_bits(frequency_op(10), {uniform<float>({3000, 3}, -1, 1, 6)});
}
