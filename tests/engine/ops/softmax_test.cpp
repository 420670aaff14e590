#include <fieldmark/engine/ops/softmax.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

namespace {
const std::vector<std::int32_t> kLabels{2, -1, 0, 1};
const std::vector<double> kSoftmaxWeights{1, 3, 0, 0.5};
const auto f_softmax = [](auto&, auto v) { return softmax(v[0]); };
const auto f_entropy = [](auto&, auto v) { return softmax_cross_entropy(v[0], kLabels); };
const auto f_softmax_weighted = [](Tape<double>&, std::span<const Var<double>> v) {
  return softmax_cross_entropy<double>(v[0], kLabels, kSoftmaxWeights);
};

// -log softmax from its definition, for logits of moderate size.
double entropy(const Tensor<double>& x, std::size_t row, std::size_t label) {
  const auto cols = static_cast<std::size_t>(x.shape[1]);
  double z = 0;
  for (std::size_t c = 0; c < cols; ++c) z += std::exp(x.data[row * cols + c]);
  return -std::log(std::exp(x.data[row * cols + label]) / z);
}
}  // namespace

TEST_CASE("softmax: values") {
  // The second row would overflow without the shift.
  const auto y = op_values(f_softmax, std::vector<Tensor<double>>{{{2, 2}, {0, std::log(3.0), 1000, 0}}});
  CHECK(std::abs(y[0] - 0.25) < 1e-15);
  CHECK(std::abs(y[1] - 0.75) < 1e-15);
  CHECK((y[2] == 1 && y[3] == 0));
  const auto x = uniform({4, 3}, -2, 2, 1);
  const double r0 = entropy(x, 0, 2), r2 = entropy(x, 2, 0), r3 = entropy(x, 3, 1);
  CHECK(std::abs(op_values(f_entropy, std::vector{x})[0] - (r0 + r2 + r3) / 3) < 1e-15);
  CHECK(std::abs(op_values(f_softmax_weighted, std::vector{x})[0] - (r0 + 0.5 * r3) / 1.5) < 1e-15);
}

TEST_CASE("softmax: gradient") {
  for (Shape s : {Shape{1, 1}, Shape{0, 5}, Shape{4, 3}, Shape{2, 3, 2, 7}}) {
    CAPTURE(s.str());
    expect_grad(f_softmax, {uniform(s, -3, 3, 7)});
  }
  expect_grad(f_entropy, {uniform({4, 3}, -3, 3, 7)});
  expect_grad(f_entropy, {uniform({2, 2, 3}, -3, 3, 7)});
  expect_grad(f_softmax_weighted, {uniform({4, 5}, -3, 3, 7)});
}

TEST_CASE("softmax: cross-entropy of logits that overflow exp") {
  const std::vector<std::int32_t> label{0, 0};
  const std::vector<Tensor<float>> x{{{2, 3}, {-1e4f, 1e4f, 0, 1e4f, -1e4f, -1e4f}}};
  const auto r = run_op([&](auto&, auto v) { return softmax_cross_entropy(v[0], label); }, x);
  CHECK(r[0][0] == 1e4f);  // (2e4 + 0) / 2
  for (float g : r[1]) CHECK(std::isfinite(g));
}

TEST_CASE("softmax: a certain label keeps its tiny loss and slope") {
  // exp(-20) = 2e-9 is lost in 1 + 2e-9, and hence in log(sum) and in p - 1.
  const std::vector<std::int32_t> label{1};
  const std::vector<Tensor<float>> x{{{1, 3}, {-20, 0, -20}}};
  const auto r = run_op([&](auto&, auto v) { return softmax_cross_entropy(v[0], label); }, x);
  const double e = std::exp(-20.0), u = static_cast<double>(uniform<float>({1}, -1, 1, 99)[0]);
  CHECK(std::abs(static_cast<double>(r[0][0]) / std::log1p(2 * e) - 1) < 3e-7);
  CHECK(std::abs(static_cast<double>(r[1][1]) / (-2 * e / (1 + 2 * e) * u) - 1) < 3e-7);
}

TEST_CASE("softmax: rows that are ignored give nothing, even where they are not finite") {
  const std::vector<std::int32_t> label{-1, 1};
  const std::vector<Tensor<float>> x{{{2, 2}, {INFINITY, NAN, 0, 0}}};
  const auto r = run_op([&](auto&, auto v) { return softmax_cross_entropy(v[0], label); }, x);
  CHECK(std::abs(r[0][0] - std::log(2.f)) < 1e-7f);
  CHECK((r[1][0] == 0 && r[1][1] == 0));
}

TEST_CASE("softmax: a cross-entropy of no row is an error") {
  Tape<double> tape;
  const Tensor<double> two({2, 3}), none({0, 3});
  const std::vector<std::int32_t> ignored{-1, -1}, label{-1, 1};
  const std::vector<double> weights{1, 0};
  CHECK_THROWS_WITH(
      softmax_cross_entropy(tape.constant(two), ignored),
      "[softmax_cross_entropy] labels: at least one row must count, got 2 rows whose label is -1 or "
      "whose weight is 0");
  CHECK_THROWS_AS(softmax_cross_entropy<double>(tape.constant(two), label, weights), ValueError);
  CHECK_THROWS_WITH(softmax_cross_entropy(tape.constant(none), {}),
                    "[softmax_cross_entropy] logits must have at least one row [.., C], got shape [0, 3]");
}

TEST_CASE("softmax: errors") {
  Tape<double> tape;
  const Tensor<double> empty({2, 0}), x({4, 2}), scalar(Shape{});
  CHECK_THROWS_WITH(softmax(tape.constant(empty)),
                    "[softmax] x must have at least one column [.., C], got shape [2, 0]");
  CHECK_THROWS_AS(softmax(tape.constant(scalar)), ShapeError);
  CHECK_THROWS_WITH(
      softmax_cross_entropy(tape.constant(x), kLabels),
      "[softmax_cross_entropy] labels: entry 0 must be in [-1, 2) (-1 or a column of logits), got 2");
  CHECK_THROWS_WITH(softmax_cross_entropy(tape.constant(x), {}),
                    Contains("each of the 4 rows of logits, got 0"));
  const std::vector<std::int32_t> label(4);
  const std::vector<double> few(3, 1.0), negative{1, 1, 1, -1};
  CHECK_THROWS_WITH(softmax_cross_entropy<double>(tape.constant(x), label, few), Contains("got 3"));
  CHECK_THROWS_WITH(softmax_cross_entropy<double>(tape.constant(x), label, negative),
                    Contains("entry 3 must be 0"));
}

TEST_CASE("softmax: float against double, and the same bits for any thread count") {
  std::vector<std::int32_t> label(3000);
  for (std::size_t r = 0; r < label.size(); ++r) label[r] = static_cast<std::int32_t>(r % 50) - 1;
  const auto f = [&](auto&, auto v) { return softmax_cross_entropy(v[0], label); };
  const auto x = uniform<float>({3000, 49}, -6, 6, 1);
  expect_same_bits(f_softmax, {x});
  expect_same_bits(f, {x});
  CHECK(float_error(f_softmax, {x}) < 4e-7);  // measured 1.4e-7
  const auto rows = [](Index e) { return std::vector{uniform<float>({3, e}, -6, 6, 2)}; };
  const std::vector<std::int32_t> first{0, -1, 0};
  CHECK(float_error_to_130(f_softmax, rows) < 1e-6);
  CHECK(float_error_to_130([&](auto&, auto v) { return softmax_cross_entropy(v[0], first); }, rows) < 1e-6);
  CHECK(float_error(f, {x}) < 4e-7);
}

TEST_CASE("softmax: labels and weights may change or be gone when the backward runs") {
  const std::vector<Tensor<double>> x{uniform({4, 3}, -2, 2, 1)};
  const auto gone = [](Tape<double>&, std::span<const Var<double>> v) {
    std::vector<std::int32_t> labels = kLabels;
    std::vector<double> weights = kSoftmaxWeights;
    const auto y = softmax_cross_entropy<double>(v[0], labels, weights);
    std::ranges::fill(labels, 1 << 30);
    std::ranges::fill(weights, NAN);
    return y;
  };
  CHECK(run_op(gone, x) == run_op(f_softmax_weighted, x));
}
