#include <fieldmark/core/error.h>
#include <fieldmark/watermark/mark/power_budget.h>

#include <cmath>

#include "support/catch.h"
#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
const std::vector<double> kMask{1, 0, 0.5, 2};

auto budget(const std::vector<double>& mask, double target) {
  return [&mask, target](auto&, auto v) { return power_budget<double>(v[0], mask, target); };
}
}  // namespace

TEST_CASE("power_budget: the masked pixels have the wanted power, all keep their direction") {
  const Tensor<double> x = uniform({4, 3}, -2, 2, 1);
  const double target = std::pow(10.0, -34.5 / 20);
  const auto y = op_values(budget(kMask, target), std::vector{x});
  double power = 0;
  for (Index i = 0; i < 12; ++i) {
    power += kMask[static_cast<std::size_t>(i / 3)] * y[static_cast<std::size_t>(i)] *
             y[static_cast<std::size_t>(i)];
    CHECK(y[static_cast<std::size_t>(i)] / x[i] == Approx(y[0] / x[0]).epsilon(1e-13));
  }
  CHECK(y[0] / x[0] > 0);
  CHECK(-10 * std::log10(power / (3 * 3.5)) == Approx(34.5).epsilon(1e-10));
}

TEST_CASE("power_budget: any size of residual becomes the same image, none stays none") {
  const Tensor<double> x = uniform({4, 3}, -1, 1, 2);
  const auto y = op_values(budget(kMask, 0.1), std::vector{x});
  for (double size : {1e-3, 1e6}) {
    Tensor<double> other = x;
    for (double& v : other.data) v *= size;
    const auto scaled = op_values(budget(kMask, 0.1), std::vector{other});
    for (std::size_t i = 0; i < y.size(); ++i) CHECK(scaled[i] == Approx(y[i]).epsilon(1e-5));
  }
  CHECK(op_values(budget(kMask, 0.1), std::vector{Tensor<double>({4, 3})}) == std::vector<double>(12, 0.0));
  const std::vector<double> nowhere(4, 0.0);
  CHECK(op_values(budget(nowhere, 0.1), std::vector{x}) == std::vector<double>(12, 0.0));
}

TEST_CASE("power_budget: gradient, and none along the residual itself") {
  const std::vector<double> one{1}, none, nowhere(4, 0.0);
  expect_grad(budget(kMask, 0.3), {uniform({4, 3}, -1, 1, 3)});
  expect_grad(budget(one, 2), {uniform({1, 3}, 0.5, 1, 3)});
  expect_grad(budget(none, 2), {Tensor<double>({0, 3})});
  expect_grad(budget(nowhere, 2), {uniform({4, 3}, -1, 1, 3)});

  Tape<double> tape;
  const Tensor<double> x = uniform({4, 3}, -1, 1, 4);
  Tensor<double> dx({4, 3});
  const std::vector<double> all(4, 1.0);
  tape.backward(power_budget<double>(tape.leaf(x, dx), all, 0.3), uniform({4, 3}, -1, 1, 5).data);
  double along = 0;
  for (Index i = 0; i < 12; ++i) along += dx[i] * x[i];
  CHECK(std::abs(along) < 1e-10);
}

TEST_CASE("power_budget: one and two threads give the same bits, float is near double") {
  constexpr Index kPixels = 100000;
  const std::vector<float> mask = uniform<float>({kPixels}, 0, 1, 6).data;
  const std::vector<double> exact(mask.begin(), mask.end());
  const std::vector inputs{uniform<float>({kPixels, 3}, -1, 1, 7)};
  const auto either = [&](auto&, auto v) {
    if constexpr (std::is_same_v<std::decay_t<decltype(*v[0].value())>, float>)
      return power_budget<float>(v[0], mask, 0.02);
    else
      return power_budget<double>(v[0], exact, 0.02);
  };
  expect_same_bits(either, inputs);
  CHECK(float_error(either, inputs) < 1e-6);
}

TEST_CASE("power_budget: errors name what does not fit") {
  Tape<double> tape;
  const Tensor<double> values({4, 3}), flat(Shape{4});
  const Var<double> x = tape.constant(values);
  CHECK_THROWS_WITH(power_budget<double>(tape.constant(flat), kMask, 1),
                    "[power_budget] x must have rank 2 [P, C], got shape [4]");
  CHECK_THROWS_AS(power_budget<double>(x, std::span(kMask).first(3), 1), ShapeError);
  CHECK_THROWS_WITH(power_budget<double>(x, std::span(kMask).first(3), 1),
                    "[power_budget] mask must have one number a row of x (4), got 3");
  for (double bad : {0.0, -1.0, std::nan("")})
    CHECK_THROWS_AS(power_budget<double>(x, kMask, bad), ValueError);
  CHECK_THROWS_WITH(power_budget<double>(x, kMask, 0),
                    Contains("[power_budget] target must be positive, got 0"));
}

TEST_CASE("power_budget: takes vectors, with the type of the Var") {
  const Tensor<double> x({4, 1}, {2, 5, 2, -2});
  const auto y = op_values([](auto&, auto v) { return power_budget(v[0], kMask, 0.5); }, std::vector{x});
  CHECK(y[0] == Approx(0.5).epsilon(1e-12));
  CHECK(y[1] == Approx(1.25).epsilon(1e-12));
}
