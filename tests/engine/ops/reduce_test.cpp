#include <fieldmark/engine/ops/reduce.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

static const auto f_sum = [](auto&, auto v) { return sum(v[0]); };
static const auto f_mean = [](auto&, auto v) { return mean(v[0]); };
static const std::vector<double> kWeights{0, 1, 0.5, 2.5, 0, 4};
static const auto f_weighted = [](Tape<double>&, std::span<const Var<double>> v) {
  return weighted_mean<double>(v[0], kWeights);
};

TEST_CASE("reduce: values") {
  const std::vector<Tensor<double>> in{{{2, 3}, {1, 2, 4, 8, 16, 32}}}, none{Tensor<double>({0, 3})};
  CHECK(op_values(f_sum, none) == std::vector<double>{0});
  CHECK(op_values(f_sum, in) == std::vector<double>{63});
  CHECK(op_values(f_mean, in) == std::vector<double>{10.5});
  CHECK(op_values(f_weighted, in) == std::vector<double>{(2 + 2 + 20 + 128) / 8.0});
}

TEST_CASE("reduce: gradient") {
  expect_grad(f_sum, {Tensor<double>({0})});
  for (Shape s : {Shape{1}, Shape{3, 5}}) {
    CAPTURE(s.str());
    expect_grad(f_sum, {uniform(s, -1, 1, 1)});
    expect_grad(f_mean, {uniform(s, -1, 1, 1)});
  }
  expect_grad(f_weighted, {uniform({6}, -1, 1, 1)});
}

TEST_CASE("reduce: three million pixels in float") {
  // A running float sum would stop growing near 2^24 * 0.1; the reference is in long double.
  auto x = uniform<float>({3000000}, 0.1, 1, 8);
  long double want = 0;
  for (float v : x.data) want += v;
  const double total = op_values(f_sum, std::vector{x})[0], average = op_values(f_mean, std::vector{x})[0];
  CHECK(std::abs(total - static_cast<double>(want)) <=
        6e-8 * static_cast<double>(want));  // one rounding to float
  CHECK(std::abs(average - static_cast<double>(want / 3000000)) <= 6e-8 * average);

  // Almost everything cancels: pairs 1e6, -1e6 around a sum of 1e-3 per pair.
  for (std::size_t i = 0; i < x.data.size(); i += 2) {
    x.data[i] = 1e6f;
    x.data[i + 1] = -1e6f + 0.0625f;
  }
  CHECK(op_values(f_sum, std::vector{x})[0] == 0.0625f * 1500000);
}

TEST_CASE("reduce: float against double for extents of 1 to 130") {
  const auto numbers = [](Index e) { return std::vector{uniform<float>({e}, -1, 1, 3)}; };
  CHECK(float_error_to_130(f_sum, numbers) < 2e-7);
  CHECK(float_error_to_130(f_mean, numbers) < 2e-7);
}

TEST_CASE("reduce: errors") {
  Tape<double> tape;
  const Tensor<double> x({2, 3});
  const std::vector<double> few(5, 1.0), negative{1, 1, -2, 1, 1, 1}, nan(6, std::nan("")), zeros(6);
  CHECK_THROWS_WITH(weighted_mean<double>(tape.constant(x), few),
                    "[weighted_mean] weights must have one element for each of the 6 averaged, got 5");
  CHECK_THROWS_WITH(weighted_mean<double>(tape.constant(x), {}), Contains("6 averaged, got 0"));
  CHECK_THROWS_WITH(weighted_mean<double>(tape.constant(x), negative),
                    Contains("[weighted_mean] weights: entry 2 must be 0 or more, got -2"));
  CHECK_THROWS_AS(weighted_mean<double>(tape.constant(x), nan), ValueError);
  CHECK_THROWS_WITH(weighted_mean<double>(tape.constant(x), zeros),
                    "[weighted_mean] weights: at least one must be above 0, got only zeros");
  const Tensor<double> none({0, 3});
  CHECK_THROWS_WITH(mean(tape.constant(none)),
                    "[mean] there must be at least one element to average, got shape [0, 3]");
  CHECK_THROWS_AS(weighted_mean<double>(tape.constant(none), {}), ShapeError);
}

TEST_CASE("reduce: same bits for any thread count") {
  const auto x = uniform<float>({200001}, -1, 1, 1), w = uniform<float>({200001}, 0, 1, 2);
  expect_same_bits(f_sum, {x});
  expect_same_bits(f_mean, {x});
  expect_same_bits([&](auto&, auto v) { return weighted_mean<float>(v[0], w.data); }, {x});
}

TEST_CASE("reduce: weights may change or be gone when the backward runs") {
  const std::vector<Tensor<double>> in{uniform({6}, -1, 1, 1)};
  const auto gone = [](auto&, auto v) {
    std::vector<double> weights = kWeights;
    const auto y = weighted_mean<double>(v[0], weights);
    std::ranges::fill(weights, NAN);
    return y;
  };
  CHECK(run_op(gone, in) == run_op(f_weighted, in));
}
