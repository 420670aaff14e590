#include <fieldmark/engine/dual/math.h>
#include <fieldmark/engine/dual/norm.h>
#include <fieldmark/engine/dual/operators.h>

#include <array>
#include <type_traits>

#include "support/dual_op.h"

using namespace fieldmark;

namespace {

constexpr std::array<double, 4> kFixedMean{0.2, -0.1, 0.4, 0}, kFixedVariance{1, 0.3, 0.5, 2};
constexpr std::array<float, 4> kFloatFixedMean{0.2f, -0.1f, 0.4f, 0}, kFloatFixedVariance{1, 0.3f, 0.5f, 2};

const std::vector<Tensor<double>> kNormInputs{uniform({2, 3, 2, 4}, -1, 2, 1), uniform({4}, 0.5, 1, 2),
                                              uniform({4}, -1, 1, 3)};
const std::vector<Tensor<double>> kNormDirections{uniform({2, 3, 2, 4}, -1, 1, 4), uniform({4}, -1, 1, 5),
                                                  uniform({4}, -1, 1, 6)};

// The norm composed of plain ops over some axes, as the reference for the tangent.
template <class V>
V plain_norm(const V& x, const V& gamma, const V& beta, const Axes& axes) {
  const V c = x - mean(x, axes, KeepAxes::yes);
  return gamma * (c / sqrt(mean(square(c), axes, KeepAxes::yes) + 1e-5)) + beta;
}

template <class F, class G>
void expect_same_tangent(const F& f, const G& g) {
  const auto got = jvp<double>(f, kNormInputs, kNormDirections),
             want = jvp<double>(g, kNormInputs, kNormDirections);
  double worst = 0;
  for (Index i = 0; i < want.product.size(); ++i) raise_to(worst, std::abs(got.product[i] - want.product[i]));
  CHECK(worst < 1e-13);
}

}  // namespace

TEST_CASE("dual/norm: tangents are those of the formula written with plain ops") {
  expect_same_tangent([](auto&, auto x) { return layer_norm(x[0], x[1], x[2]); },
                      [](auto&, auto x) { return plain_norm(x[0], x[1], x[2], {3}); });
  expect_same_tangent([](auto&, auto x) { return batch_norm(x[0], x[1], x[2]); },
                      [](auto&, auto x) {
                        return plain_norm(x[0], x[1], x[2], {0, 1, 2});
                      });
  expect_same_tangent([](auto&, auto x) { return batch_norm(x[0], x[1], x[2], {.relu = true}); },
                      [](auto&, auto x) {
                        return relu(plain_norm(x[0], x[1], x[2], {0, 1, 2}));
                      });
  // One group, then as many groups as channels.
  expect_same_tangent([](auto&, auto x) { return group_norm(x[0], x[1], x[2], {.groups = 1, .relu = true}); },
                      [](auto&, auto x) {
                        return relu(plain_norm(x[0], x[1], x[2], {1, 2, 3}));
                      });
  expect_same_tangent([](auto&, auto x) { return group_norm(x[0], x[1], x[2], {.groups = 4}); },
                      [](auto&, auto x) {
                        return plain_norm(x[0], x[1], x[2], {1, 2});
                      });
}

TEST_CASE("dual/norm: given statistics are constants") {
  const auto f = [](auto&, auto x) {
    return batch_norm_fixed<double>(x[0], x[1], x[2], kFixedMean, kFixedVariance);
  };
  const auto r = jvp<double>(f, kNormInputs, kNormDirections);
  double worst = 0;
  for (Index i = 0; i < r.product.size(); ++i) {
    const Index c = i % 4;
    const double s = std::sqrt(kFixedVariance[at(c)] + 1e-5), n = (kNormInputs[0][i] - kFixedMean[at(c)]) / s;
    raise_to(worst, std::abs(r.product[i] -
                             (kNormDirections[1][c] * n + kNormInputs[1][c] * kNormDirections[0][i] / s +
                              kNormDirections[2][c])));
  }
  CHECK(worst < 1e-14);
}

TEST_CASE("dual/norm: parameters may be Vars, and x may") {
  const auto with = [&](const auto& norm) {
    const auto of_x = [&](auto& tape, auto x) {
      return norm(x[0], tape.constant(kNormInputs[1]), tape.constant(kNormInputs[2]));
    };
    const auto of_parameters = [&](auto& tape, auto x) {
      return norm(tape.constant(kNormInputs[0]), x[0], x[1]);
    };
    const auto all = [&](auto&, auto x) { return norm(x[0], x[1], x[2]); };
    const auto a = jvp(of_x, {kNormInputs[0]}, {kNormDirections[0]}).product;
    const auto b =
        jvp(of_parameters, {kNormInputs[1], kNormInputs[2]}, {kNormDirections[1], kNormDirections[2]})
            .product;
    const auto c = jvp<double>(all, kNormInputs, kNormDirections).product;
    double worst = 0;
    for (Index i = 0; i < c.size(); ++i) raise_to(worst, std::abs(a[i] + b[i] - c[i]));
    CHECK(worst < 1e-14);
  };
  with([](auto x, auto gamma, auto beta) { return layer_norm(x, gamma, beta); });
  with([](auto x, auto gamma, auto beta) { return group_norm(x, gamma, beta, {.groups = 2}); });
  with([](auto x, auto gamma, auto beta) { return batch_norm(x, gamma, beta); });
  with([](auto x, auto gamma, auto beta) {
    return batch_norm_fixed<double>(x, gamma, beta, kFixedMean, kFixedVariance);
  });
}

TEST_CASE("dual/norm: statistics of a batch come out") {
  BatchStatistics statistics;
  const auto f = [&](auto&, auto x) { return batch_norm(x[0], x[1], x[2], {}, &statistics); };
  jvp<double>(f, kNormInputs, kNormDirections);
  REQUIRE(statistics.mean.size() == 4);
  REQUIRE(statistics.variance.size() == 4);
  for (std::size_t c = 0; c < 4; ++c) {
    double sum = 0, squares = 0;
    for (Index p = 0; p < 12; ++p) {
      const double x = kNormInputs[0][4 * p + static_cast<Index>(c)];
      sum += x / 12, squares += x * x / 12;
    }
    CHECK(statistics.mean[c] == Approx(sum).epsilon(1e-13));
    CHECK(statistics.variance[c] == Approx(squares - sum * sum).epsilon(1e-12));
  }
}

TEST_CASE("dual/norm: in float as in double") {
  const std::vector<Tensor<float>> in{uniform<float>({2, 3, 2, 4}, -1, 2, 1), uniform<float>({4}, 0.5, 1, 2),
                                      uniform<float>({4}, -1, 1, 3)};
  const auto check = [&](const auto& f) {
    CHECK(float_products_error([&](auto& tape, auto v) { return f(tape, v[0], v[1], v[2]); }, in) < 2e-5);
  };
  check([](auto&, auto x, auto g, auto b) { return layer_norm(x, g, b); });
  check([](auto&, auto x, auto g, auto b) { return group_norm(x, g, b, {.groups = 2}); });
  check([](auto&, auto x, auto g, auto b) { return batch_norm(x, g, b); });
  check([]<class T>(Tape<T>&, auto x, auto g, auto b) {
    if constexpr (std::is_same_v<T, float>)
      return batch_norm_fixed<T>(x, g, b, kFloatFixedMean, kFloatFixedVariance);
    else
      return batch_norm_fixed<T>(x, g, b, kFixedMean, kFixedVariance);
  });
}
