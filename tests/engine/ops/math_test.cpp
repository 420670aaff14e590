#include <fieldmark/engine/ops/math.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

namespace {

// The functions with their counterparts in the C library.
template <class F>
void for_each_function(F f) {
  f(
      "negate", [](auto&, auto v) { return negate(v[0]); }, [](double x) { return -x; });
  f(
      "affine", [](auto&, auto v) { return affine(v[0], -2, 3); }, [](double x) { return 3 - 2 * x; });
  f(
      "div", [](auto&, auto v) { return div(v[0], 4); }, [](double x) { return x / 4; });
  f(
      "reciprocal", [](auto&, auto v) { return reciprocal(v[0]); }, [](double x) { return 1 / x; });
  f(
      "abs", [](auto&, auto v) { return abs(v[0]); }, [](double x) { return std::abs(x); });
  f(
      "square", [](auto&, auto v) { return square(v[0]); }, [](double x) { return x * x; });
  f(
      "sqrt", [](auto&, auto v) { return sqrt(v[0]); }, [](double x) { return std::sqrt(x); });
  f(
      "pow", [](auto&, auto v) { return pow(v[0], 1.5); }, [](double x) { return std::pow(x, 1.5); });
  f(
      "log", [](auto&, auto v) { return log(v[0]); }, [](double x) { return std::log(x); });
  f(
      "log1p", [](auto&, auto v) { return log1p(v[0]); }, [](double x) { return std::log1p(x); });
  f(
      "expm1", [](auto&, auto v) { return expm1(v[0]); }, [](double x) { return std::expm1(x); });
  f(
      "sin", [](auto&, auto v) { return sin(v[0]); }, [](double x) { return std::sin(x); });
  f(
      "cos", [](auto&, auto v) { return cos(v[0]); }, [](double x) { return std::cos(x); });
  f(
      "clamp", [](auto&, auto v) { return clamp(v[0], 0.8, 1.3); },
      [](double x) { return std::min(std::max(x, 0.8), 1.3); });
}

}  // namespace

TEST_CASE("math: values as the C library's, in float too") {
  const auto x = uniform({501}, 0.5, 2, 1);
  for_each_function([&](const char* name, auto op, auto f) {
    CAPTURE(name);
    double worst = 0;
    const auto got = op_values(op, std::vector{x});
    for (std::size_t i = 0; i < got.size(); ++i) raise_to(worst, std::abs(got[i] - f(x.data[i])));
    CHECK(worst < 2e-15);
    CHECK(float_error_to_130(op, [](Index e) { return std::vector{uniform<float>({e}, 0.5, 2, 2)}; }) < 5e-7);
  });
}

TEST_CASE("math: gradient") {
  for (Shape s : {Shape{0}, Shape{1}, Shape{3, 4}})
    for_each_function([&](const char* name, auto op, auto) {
      CAPTURE(name, s.str());
      Tensor<double> x = uniform(s, 1, 2, 3);
      for (double& v : x.data)
        if (std::abs(v - 1.3) < 0.05) v = 1.4;  // clamp has a kink
      expect_grad(op, {x});
    });
  const Tensor<double> negative({4}, {-2, -0.5, 0.5, 3});
  expect_grad([](auto&, auto v) { return pow(v[0], 2); }, {negative});
  expect_grad([](auto&, auto v) { return abs(v[0]); }, {negative});
}

TEST_CASE("math: poles, kinks and NaN") {
  const double inf = std::numeric_limits<double>::infinity();
  const std::vector<Tensor<double>> x{{{4}, {0, -1, inf, std::nan("")}}};
  const auto slope_at_0 = [&](auto op) { return run_op(op, std::vector{Tensor<double>({1}, 0.0)})[1][0]; };
  const auto log_x = op_values([](auto&, auto v) { return log(v[0]); }, x);
  CHECK((log_x[0] == -inf && std::isnan(log_x[1]) && log_x[2] == inf && std::isnan(log_x[3])));
  // Subnormal numbers, at each place of a vector.
  const std::vector<Tensor<float>> small{Tensor<float>({9}, 1e-40f)};
  for (const float y : op_values([](auto&, auto v) { return log(v[0]); }, small))
    CHECK(y == Approx(std::log(1e-40f)));
  const std::vector<Tensor<double>> smallest{Tensor<double>({5}, 5e-324)};
  for (const double y : op_values([](auto&, auto v) { return log(v[0]); }, smallest))
    CHECK(y == std::log(5e-324));
  CHECK(std::isnan(op_values([](auto&, auto v) { return sqrt(v[0]); }, x)[1]));
  CHECK(std::isnan(op_values([](auto&, auto v) { return clamp(v[0], -3, 3); }, x)[3]));
  CHECK(op_values([](auto&, auto v) { return reciprocal(v[0]); }, x)[0] == inf);
  CHECK(slope_at_0([](auto&, auto v) { return abs(v[0]); }) == 0);
  CHECK(slope_at_0([](auto&, auto v) { return pow(v[0], 0); }) == 0);
}

TEST_CASE("math: errors") {
  Tape<double> tape;
  const Tensor<double> a({2, 3});
  CHECK_THROWS_WITH(clamp(tape.constant(a), 1, 0), Contains("[clamp] low must be at most high, got 1 and 0"));
  CHECK_THROWS_AS(clamp(tape.constant(a), std::nan(""), 0), ValueError);
  CHECK_THROWS_WITH(div(tape.constant(a), 0), "[div] divisor must not be 0");
}

TEST_CASE("math: same bits for any thread count") {
  for_each_function([&](const char* name, auto op, auto) {
    CAPTURE(name);
    expect_same_bits(op, {uniform<float>({70001}, 0.5, 2, 1)});
  });
}
