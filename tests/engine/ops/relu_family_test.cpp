#include <fieldmark/engine/ops/relu_family.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

static const auto f_leaky = [](auto&, auto v) { return leaky_relu(v[0], 0.1); };
static const auto f_elu = [](auto&, auto v) { return elu(v[0], 2); };
static const auto f_silu = [](auto&, auto v) { return silu(v[0]); };
static const auto f_gelu = [](auto&, auto v) { return gelu(v[0]); };
static const auto f_cdf = [](auto&, auto v) { return normal_cdf(v[0]); };

TEST_CASE("relu_family: values") {
  const std::vector<Tensor<double>> in{{{4}, {-2, -0.5, 0, 3}}};
  CHECK(op_values(f_leaky, in) == std::vector<double>{-0.2, -0.05, 0, 3});
  const auto elu_x = op_values(f_elu, in), silu_x = op_values(f_silu, in), gelu_x = op_values(f_gelu, in),
             cdf_x = op_values(f_cdf, in);
  for (std::size_t i = 0; i < 4; ++i) {
    const double x = in[0].data[i];
    CHECK(elu_x[i] == Approx(x > 0 ? x : 2 * std::expm1(x)).epsilon(1e-15));
    CHECK(silu_x[i] == Approx(x / (1 + std::exp(-x))).epsilon(1e-15));
    CHECK(gelu_x[i] == Approx(x * (1 + std::erf(x / std::sqrt(2.0))) / 2).epsilon(1e-14));
    CHECK(cdf_x[i] == Approx((1 + std::erf(x / std::sqrt(2.0))) / 2).epsilon(1e-14));
  }
  // Far below 0, from a table of the normal distribution.
  const std::vector<Tensor<double>> far{Tensor<double>({1}, -10.0)};
  CHECK(op_values(f_cdf, far)[0] == Approx(7.619853024160527e-24).epsilon(1e-13));
}

TEST_CASE("relu_family: gradient") {
  for (Shape s : {Shape{0}, Shape{1}, Shape{3, 5}}) {
    CAPTURE(s.str());
    for (double lo : {-2.0, 0.5}) {
      const auto x = uniform(s, lo, lo + 1.5, 1);
      expect_grad(f_leaky, {x});
      expect_grad(f_elu, {x});
      expect_grad(f_silu, {x});
      expect_grad(f_gelu, {x});
      expect_grad(f_cdf, {x});
    }
  }
}

TEST_CASE("relu_family: float against double for extents of 1 to 130, and NaN") {
  const auto numbers = [](Index e) { return std::vector{uniform<float>({e}, -4, 4, 3)}; };
  CHECK(float_error_to_130(f_leaky, numbers) < 2e-7);
  CHECK(float_error_to_130(f_elu, numbers) < 3e-7);
  CHECK(float_error_to_130(f_silu, numbers) < 4e-7);
  CHECK(float_error_to_130(f_gelu, numbers) < 4e-7);
  CHECK(float_error_to_130(f_cdf, numbers) < 4e-7);
  const std::vector<Tensor<double>> nan{Tensor<double>({1}, std::nan(""))};
  CHECK(std::isnan(op_values(f_leaky, nan)[0]));
  CHECK(std::isnan(op_values(f_elu, nan)[0]));
  CHECK(std::isnan(op_values(f_silu, nan)[0]));
  CHECK(std::isnan(op_values(f_gelu, nan)[0]));
  CHECK(std::isnan(op_values(f_cdf, nan)[0]));
}

TEST_CASE("relu_family: same bits for any thread count") {
  const auto x = uniform<float>({70001}, -3, 3, 1);
  expect_same_bits(f_leaky, {x});
  expect_same_bits(f_elu, {x});
  expect_same_bits(f_silu, {x});
  expect_same_bits(f_gelu, {x});
  expect_same_bits(f_cdf, {x});
}
