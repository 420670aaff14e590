#include <fieldmark/engine/ops/loss.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

namespace {
const std::vector<double> kLossWeights{0, 1, 0.5, 2.5};
const auto f_mse = [](auto&, auto v) { return mse_loss(v[0], v[1]); };
const auto f_l1 = [](auto&, auto v) { return l1_loss(v[0], v[1]); };
const auto f_huber = [](auto&, auto v) { return huber_loss(v[0], v[1], 0.5); };

// Cross-entropy against constants that outlive the op.
template <class T>
auto bce(const std::vector<T>& targets, const std::vector<T>& weights = {}) {
  return [&targets, &weights](auto&, auto v) { return bce_with_logits<T>(v[0], targets, weights); };
}

// Returns b such that no |a - b| is near the point where huber's parabola with delta 0.5 becomes a line.
Tensor<double> away_from_kink(const Tensor<double>& a, unsigned seed) {
  auto b = uniform(a.shape, -1, 1, seed);
  for (std::size_t i = 0; i < b.data.size(); ++i) {
    double& v = b.data[i];
    if (std::abs(std::abs(v - a.data[i]) - 0.5) < 0.05) v += v > a.data[i] ? 0.1 : -0.1;
  }
  return b;
}
}  // namespace

TEST_CASE("loss: values") {
  const std::vector<Tensor<double>> in{{{4}, {1, 2, 3, 4}}, {{4}, {1, 2.25, 5, 3}}};
  CHECK(op_values(f_mse, in)[0] == (0.0625 + 4 + 1) / 4);
  CHECK(op_values(f_l1, in)[0] == (0.25 + 2 + 1) / 4);
  CHECK(op_values(f_huber, in)[0] == (0.03125 + 0.5 * 1.75 + 0.5 * 0.75) / 4);
  const auto weighted = [](auto&, auto v) { return mse_loss<double>(v[0], v[1], kLossWeights); };
  CHECK(op_values(weighted, in)[0] == (0.0625 + 2 + 2.5) / 4);
  const std::vector<double> t{0, 1, 0.25, 0.5};
  const std::vector<Tensor<double>> x{{{4}, {0, 2, -1, 3}}};
  double want = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const double s = 1 / (1 + std::exp(-x[0].data[i]));
    want -= t[i] * std::log(s) + (1 - t[i]) * std::log(1 - s);
  }
  CHECK(std::abs(op_values(bce(t), x)[0] - want / 4) < 1e-15);
}

TEST_CASE("loss: nothing to average is an error") {
  Tape<double> tape;
  const Tensor<double> empty({0, 3}), some({4}, 0.5);
  const auto none = tape.constant(empty), x = tape.constant(some);
  CHECK_THROWS_WITH(mse_loss(none, none),
                    "[mse_loss] there must be at least one element to average, got shape [0, 3]");
  CHECK_THROWS_AS(l1_loss(none, none), ShapeError);
  CHECK_THROWS_AS(huber_loss(none, none, 1), ShapeError);
  CHECK_THROWS_AS(bce_with_logits<double>(none, {}), ShapeError);
  const std::vector<double> zeros(4);
  CHECK_THROWS_WITH(huber_loss<double>(x, x, 1, zeros),
                    "[huber_loss] weights: at least one must be above 0, got only zeros");
  CHECK_THROWS_AS(mse_loss<double>(x, x, zeros), ValueError);
  CHECK_THROWS_AS(l1_loss<double>(x, x, zeros), ValueError);
  CHECK_THROWS_AS(bce_with_logits<double>(x, zeros, zeros), ValueError);
}

TEST_CASE("loss: gradient") {
  for (Shape s : {Shape{1}, Shape{3, 5}}) {
    CAPTURE(s.str());
    expect_grad(f_mse, {uniform(s, -1, 1, 1), uniform(s, -1, 1, 2)});
    expect_grad(f_l1, {uniform(s, -1, 1, 1), uniform(s, 1.1, 2, 2)});
    const auto a = uniform(s, -1, 1, 1);
    expect_grad(f_huber, {a, away_from_kink(a, 2)});
    const auto t = uniform(s, 0, 1, 3);
    expect_grad(bce(t.data), {uniform(s, -4, 4, 2)});
  }
  const auto a = uniform({4}, -1, 1, 1), b = away_from_kink(a, 2), t = uniform({4}, 0, 1, 3);
  using Vars = std::span<const Var<double>>;
  expect_grad([](Tape<double>&, Vars v) { return mse_loss<double>(v[0], v[1], kLossWeights); }, {a, b});
  expect_grad([](Tape<double>&, Vars v) { return huber_loss<double>(v[0], v[1], 0.5, kLossWeights); },
              {a, b});
  expect_grad(bce(t.data, kLossWeights), {a});
}

TEST_CASE("loss: bce at logits of +-100 keeps value and slope to one rounding") {
  const auto run = [](float x, float target) {
    const std::vector<float> t{target};
    Tape<float> tape;
    const Tensor<float> logit({1}, x);
    Tensor<float> g({1});
    const auto y = bce_with_logits<float>(tape.leaf(logit, g), t);
    tape.backward(y);
    return std::pair{y.value()[0], g[0]};
  };
  const float tiny = std::exp(-100.f);  // 3.8e-44, a subnormal number
  CHECK(run(100, 1) == std::pair{tiny, -tiny});
  CHECK(run(-100, 0) == std::pair{tiny, tiny});
  CHECK(run(100, 0) == std::pair{100.f, 1.f});
  CHECK(run(-100, 1) == std::pair{100.f, -1.f});
  CHECK(run(0, 0.5f) == std::pair{std::log(2.f), 0.f});
  CHECK(run(1e30f, 1) == std::pair{0.f, 0.f});
}

TEST_CASE("loss: errors") {
  Tape<double> tape;
  const Tensor<double> a({2, 3}), b({3, 2});
  const auto x = tape.constant(a), y = tape.constant(b);
  CHECK_THROWS_WITH(mse_loss(x, y), "[mse_loss] b must have the shape of a, [2, 3], got shape [3, 2]");
  CHECK_THROWS_WITH(huber_loss(x, y, 1), "[huber_loss] b must have the shape of a, [2, 3], got shape [3, 2]");
  CHECK_THROWS_WITH(huber_loss(x, x, 0), Contains("[huber_loss] delta must be above 0, got 0"));
  CHECK_THROWS_WITH(mse_loss<double>(x, x, kLossWeights),
                    Contains("[mse_loss] weights must have") && Contains("got 4"));
  CHECK_THROWS_WITH(bce_with_logits<double>(x, kLossWeights), Contains("whose shape is [2, 3], got 4"));
  const std::vector<double> outside{0, 0, 0, 1.5, 0, 0};
  CHECK_THROWS_WITH(bce_with_logits<double>(x, outside),
                    Contains("[bce_with_logits] targets: entry 3 must be in [0, 1], got 1.5"));
}

TEST_CASE("loss: float against double, and the same bits for any thread count") {
  const auto a = uniform<float>({70001}, -1, 1, 1), b = uniform<float>({70001}, 0, 1, 2);
  const std::vector<double> exact(b.data.begin(), b.data.end());
  const auto f = [&](auto& tape, auto v) {
    if constexpr (std::is_same_v<std::decay_t<decltype(tape)>, Tape<float>>)
      return bce_with_logits<float>(v[0], b.data);
    else
      return bce_with_logits<double>(v[0], exact);
  };
  expect_same_bits(f_mse, {a, b});
  expect_same_bits(f_huber, {a, b});
  expect_same_bits(f, {a});
  const auto pairs = [](Index e) {
    return std::vector{uniform<float>({e}, -1, 1, 3), uniform<float>({e}, 0, 1, 4)};
  };
  CHECK(float_error_to_130(f_mse, pairs) < 3e-7);
  CHECK(float_error_to_130(f_huber, pairs) < 3e-7);
  CHECK(float_error(f_mse, {a, b}) < 2e-7);  // measured 8.5e-8
  CHECK(float_error(f_huber, {a, b}) < 2e-7);
  CHECK(float_error(f, {a}) < 3e-7);  // measured 1.6e-7
}

TEST_CASE("loss: weights and targets may change or be gone when the backward runs") {
  const auto a = uniform({4}, -1, 1, 1), b = uniform({4}, -1, 1, 2), t = uniform({4}, 0, 1, 3);
  const auto gone = [&](auto op) {
    return [=](auto&, auto v) {
      std::vector<double> targets = t.data, weights = kLossWeights;
      const auto y = op(v, targets, weights);
      std::ranges::fill(targets, NAN);
      std::ranges::fill(weights, NAN);
      return y;
    };
  };
  using Vars = std::span<const Var<double>>;
  CHECK(run_op(gone([](Vars v, const auto&, const auto& w) { return mse_loss<double>(v[0], v[1], w); }),
               std::vector{a, b}) ==
        run_op([](auto&, Vars v) { return mse_loss<double>(v[0], v[1], kLossWeights); }, std::vector{a, b}));
  CHECK(
      run_op(gone([](Vars v, const auto& to, const auto& w) { return bce_with_logits<double>(v[0], to, w); }),
             std::vector{a}) == run_op(bce(t.data, kLossWeights), std::vector{a}));
}
