#include <fieldmark/engine/dual/loss.h>

#include <array>
#include <cmath>
#include <limits>

#include "support/dual_op.h"

using namespace fieldmark;

namespace {

const Tensor<double> kLossA({2, 2}, {1, 2, 3, 4}), kLossB({2, 2}, {1.5, 2, 1, 4.25});
const Tensor<double> kLossDa({2, 2}, {1, 10, 100, 1000}), kLossDb({2, 2}, {2, 20, 200, 2000});
constexpr std::array<double, 4> kDualLossWeights{1, 1, 2, 4};
constexpr std::array<float, 4> kFloatLossWeights{1, 1, 2, 4};
constexpr std::array<double, 4> kLossTargets{0, 1, 0.25, 0.5};
constexpr std::array<float, 4> kFloatLossTargets{0, 1, 0.25, 0.5};

template <class F>
double loss_tangent(const F& f) {
  return jvp([&](auto&, auto x) { return f(x[0], x[1]); }, {kLossA, kLossB}, {kLossDa, kLossDb}).product[0];
}

double loss_sigmoid(double x) { return 1 / (1 + std::exp(-x)); }

}  // namespace

// d = -0.5, 0, 2, -0.25 and d' = -1, -10, -100, -1000.
TEST_CASE("dual/loss: tangents of losses of a difference") {
  CHECK(loss_tangent([](auto a, auto b) { return mse_loss(a, b); }) == 2 * (0.5 - 200 + 250) / 4);
  CHECK(loss_tangent([](auto a, auto b) { return l1_loss(a, b); }) == (1 - 100 + 1000) / 4.0);
  CHECK(loss_tangent([](auto a, auto b) { return huber_loss(a, b, 0.375); }) == (0.375 - 37.5 + 250) / 4);
  CHECK(loss_tangent([](auto a, auto b) { return mse_loss<double>(a, b, kDualLossWeights); }) ==
        2 * (0.5 - 400 + 1000) / 8);
  CHECK(loss_tangent([](auto a, auto b) { return l1_loss<double>(a, b, kDualLossWeights); }) ==
        (1 - 200 + 4000) / 8.0);
  CHECK(loss_tangent([](auto a, auto b) { return huber_loss<double>(a, b, 0.375, kDualLossWeights); }) ==
        (0.375 - 75 + 1000) / 8);
}

TEST_CASE("dual/loss: one side may be a Var") {
  const auto against = [&](const auto& loss) {
    return jvp(
               [&](auto& tape, auto x) {
                 return add(loss(x[0], tape.constant(kLossB)), loss(tape.constant(kLossB), x[0]));
               },
               {kLossA}, {kLossDa})
        .product[0];
  };
  CHECK(against([](auto a, auto b) { return mse_loss(a, b); }) == 2 * 2 * (-0.5 + 200 - 250) / 4);
  CHECK(against([](auto a, auto b) { return l1_loss(a, b); }) == 2 * (-1 + 100 - 1000) / 4.0);
  CHECK(against([](auto a, auto b) { return huber_loss(a, b, 0.375); }) == 2 * (-0.375 + 37.5 - 250) / 4);
}

TEST_CASE("dual/loss: binary cross-entropy") {
  double want = 0, weighted = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const double term = (loss_sigmoid(kLossA.data[i]) - kLossTargets[i]) * kLossDa.data[i];
    want += term / 4;
    weighted += term * kDualLossWeights[i] / 8;
  }
  CHECK(loss_tangent([](auto a, auto) { return bce_with_logits<double>(a, kLossTargets); }) ==
        Approx(want).epsilon(1e-14));
  CHECK(loss_tangent([](auto a, auto) {
          return bce_with_logits<double>(a, kLossTargets, kDualLossWeights);
        }) == Approx(weighted).epsilon(1e-14));
}

TEST_CASE("dual/loss: cross-entropy counts rows with a label, whatever the others hold") {
  constexpr std::array<std::int32_t, 2> both{1, 0}, second{-1, 0};
  constexpr std::array<double, 2> weights{3, 1};
  const double p = loss_sigmoid(1);  // of the second of two columns, whose logits differ by 1
  const double row0 = (1 - p) * 1 + (p - 1) * 10, row1 = (1 - p - 1) * 100 + p * 1000;
  const auto of = [](auto labels, std::span<const double> w = {}) {
    return [=](auto a, auto) { return softmax_cross_entropy<double>(a, labels, w); };
  };
  CHECK(loss_tangent(of(std::span<const std::int32_t>(both))) == Approx((row0 + row1) / 2).epsilon(1e-14));
  CHECK(loss_tangent(of(std::span<const std::int32_t>(both), weights)) ==
        Approx((3 * row0 + row1) / 4).epsilon(1e-14));
  const Tensor<double> x({2, 2}, {std::numeric_limits<double>::quiet_NaN(), 0, 3, 4});
  const auto f = [&](auto&, auto q) { return softmax_cross_entropy<double>(q[0], second); };
  CHECK(jvp(f, {x}, {kLossDa}).product[0] == Approx(row1).epsilon(1e-14));
  const auto h = hvp(f, {x}, {kLossDa}).products[0];
  CHECK(h[0] == 0);
  CHECK(h[1] == 0);
  CHECK(h[2] == Approx(p * (1 - p) * (100 - 1000)).epsilon(1e-14));
}

TEST_CASE("dual/loss: feature_distance where features are all 0 has a tangent of 0 from there") {
  constexpr std::array<double, 2> weights{1, 3};
  const Tensor<double> a({1, 1, 2, 2}, {0, 0, 3, 4}), b({1, 1, 2, 2}, {1, 0, 0, 1}),
      v({1, 1, 2, 2}, {5, 6, 1, 0});
  const auto f = [&](auto& tape, auto x) {
    return feature_distance<double>(x[0], tape.constant(b), weights);
  };
  // For the second pixel: n = (0.6, 0.8), n' = (v - n (n v)) / 5 = (0.128, -0.096), d = (0.6, -0.2).
  CHECK(jvp(f, {a}, {v}).product[0] == Approx((0.6 * 0.128 + 3 * 0.2 * 0.096)).epsilon(1e-9));
  const auto both = [&](auto&, auto x) { return feature_distance<double>(x[0], x[0], weights); };
  CHECK(jvp(both, {a}, {v}).product[0] == 0);
}

TEST_CASE("dual/loss: in float as in double") {
  const std::vector<Tensor<float>> in{uniform<float>({2, 2}, -2, 2, 1), uniform<float>({2, 2}, -2, 2, 2)};
  constexpr std::array<std::int32_t, 2> labels{1, 0};
  const auto check = [&](const auto& f) {
    CHECK(float_products_error([&](auto& tape, auto v) { return f(tape, v[0], v[1]); }, in) < 1e-5);
  };
  check([](auto&, auto a, auto b) { return add(mse_loss(a, b), add(l1_loss(a, b), huber_loss(a, b, 1))); });
  check([&](auto&, auto a, auto) { return softmax_cross_entropy(a, labels); });
  check([]<class T>(Tape<T>&, auto a, auto) {
    if constexpr (std::is_same_v<T, float>)
      return bce_with_logits<T>(a, kFloatLossTargets, kFloatLossWeights);
    else
      return bce_with_logits<T>(a, kLossTargets, kDualLossWeights);
  });
}
