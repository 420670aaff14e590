#include <fieldmark/engine/dual/math.h>

#include <cmath>
#include <numbers>

#include "support/dual_op.h"

using namespace fieldmark;

namespace {

// Checks f(x), f'(x) and f''(x) from Duals against closed forms.
template <class F>
void expect_derivatives(const F& f, double x, double first, double second) {
  CAPTURE(x);
  const auto d = derivatives([&](auto&, auto v) { return f(v[0]); }, x);
  CHECK(d.first == Approx(first).epsilon(1e-13));
  CHECK(d.second == Approx(second).epsilon(1e-13).margin(1e-15));
}

double math_sigmoid(double x) { return 1 / (1 + std::exp(-x)); }
double math_density(double x) { return std::exp(-x * x / 2) / std::sqrt(2 * std::numbers::pi); }

}  // namespace

TEST_CASE("dual/math: first and second derivatives of powers, roots and logarithms") {
  for (const double x : {0.3, 1.0, 2.5}) {
    expect_derivatives([](auto v) { return negate(v); }, x, -1, 0);
    expect_derivatives([](auto v) { return affine(v, -2.5, 3); }, x, -2.5, 0);
    expect_derivatives([](auto v) { return div(v, 4); }, x, 0.25, 0);
    expect_derivatives([](auto v) { return reciprocal(v); }, x, -1 / (x * x), 2 / (x * x * x));
    expect_derivatives([](auto v) { return square(v); }, x, 2 * x, 2);
    expect_derivatives([](auto v) { return sqrt(v); }, x, 0.5 / std::sqrt(x), -0.25 / (x * std::sqrt(x)));
    expect_derivatives([](auto v) { return pow(v, 3); }, x, 3 * x * x, 6 * x);
    expect_derivatives([](auto v) { return pow(v, -1.5); }, x, -1.5 * std::pow(x, -2.5),
                       3.75 * std::pow(x, -3.5));
    expect_derivatives([](auto v) { return log(v); }, x, 1 / x, -1 / (x * x));
    expect_derivatives([](auto v) { return log1p(v); }, x, 1 / (1 + x), -1 / ((1 + x) * (1 + x)));
  }
}

TEST_CASE("dual/math: first and second derivatives of exponentials and circular functions") {
  for (const double x : {-1.2, 0.0, 0.7}) {
    const double e = std::exp(x), s = math_sigmoid(x), c = std::cosh(x), t = std::tanh(x);
    expect_derivatives([](auto v) { return exp(v); }, x, e, e);
    expect_derivatives([](auto v) { return truncated_exp(v); }, x, e, e);
    expect_derivatives([](auto v) { return expm1(v); }, x, e, e);
    expect_derivatives([](auto v) { return sin(v); }, x, std::cos(x), -std::sin(x));
    expect_derivatives([](auto v) { return cos(v); }, x, -std::sin(x), -std::cos(x));
    expect_derivatives([](auto v) { return tanh(v); }, x, 1 / (c * c), -2 * t / (c * c));
    expect_derivatives([](auto v) { return sigmoid(v); }, x, s * (1 - s), s * (1 - s) * (1 - 2 * s));
    expect_derivatives([](auto v) { return softplus(v); }, x, s, s * (1 - s));
    expect_derivatives([](auto v) { return silu(v); }, x, s * (1 + x * (1 - s)),
                       s * (1 - s) * (2 + x * (1 - 2 * s)));
    expect_derivatives([](auto v) { return gelu(v); }, x,
                       (1 + std::erf(x / std::numbers::sqrt2)) / 2 + x * math_density(x),
                       (2 - x * x) * math_density(x));
    expect_derivatives([](auto v) { return normal_cdf(v); }, x, math_density(x), -x * math_density(x));
  }
}

TEST_CASE("dual/math: kinks follow the backward, and a mask is a constant") {
  for (const double x : {-0.5, 0.0, 0.5}) {
    const double sign = x > 0 ? 1 : x < 0 ? -1 : 0, e = std::exp(x);
    expect_derivatives([](auto v) { return relu(v); }, x, x > 0 ? 1 : 0, 0);
    expect_derivatives([](auto v) { return abs(v); }, x, sign, 0);
    expect_derivatives([](auto v) { return leaky_relu(v, 0.2); }, x, x > 0 ? 1 : 0.2, 0);
    expect_derivatives([](auto v) { return elu(v, 0.7); }, x, x > 0 ? 1 : 0.7 * e, x > 0 ? 0 : 0.7 * e);
    expect_derivatives([](auto v) { return clamp(v, -0.5, 0.2); }, x, x > 0.2 ? 0 : 1, 0);
  }
}

TEST_CASE("dual/math: what is not chosen may overflow, and a power of 0 has no tangent") {
  expect_derivatives([](auto v) { return elu(v); }, 800, 1, 0);
  expect_derivatives([](auto v) { return silu(v); }, 800, 1, 0);
  expect_derivatives([](auto v) { return softplus(v); }, 800, 1, 0);
  expect_derivatives([](auto v) { return pow(v, 0); }, 0, 0, 0);
  expect_derivatives([](auto v) { return pow(v, 1); }, 0, 1, 0);
  expect_derivatives([](auto v) { return pow(v, 2); }, 0, 0, 2);
}

TEST_CASE("dual/math: in float as in double") {
  const auto x = uniform<float>({67}, 0.3, 2, 1);
  const auto check = [&](const auto& f) {
    CHECK(float_products_error([&](auto&, auto v) { return f(v[0]); }, {x}) < 1e-5);
  };
  check([](auto v) { return pow(sqrt(square(reciprocal(v))), 1.7); });
  check([](auto v) { return log(log1p(expm1(affine(v, 0.5, 1)))); });
  check([](auto v) { return sin(cos(div(negate(abs(v)), 3))); });
  check([](auto v) { return sigmoid(tanh(exp(clamp(v, 0.5, 1.5)))); });
  check([](auto v) { return truncated_exp(softplus(relu(v))); });
  check([](auto v) { return leaky_relu(elu(silu(affine(v, -1, 1)))); });
  check([](auto v) { return gelu(normal_cdf(v)); });
}
