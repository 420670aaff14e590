#include <fieldmark/engine/ops/feature_distance.h>

#include "support/expect_grad.h"
#include "support/run_op.h"
#include "support/worst.h"

using namespace fieldmark;

namespace {

template <class T>
auto with(const std::vector<T>& weights) {
  return [&weights](auto&, auto v) { return feature_distance<T>(v[0], v[1], weights); };
}

// Weights of either scalar type, because float_error() uses both.
struct Weights {
  std::vector<float> f;
  std::vector<double> d;
  explicit Weights(Index n) : f(uniform<float>({n}, -1, 2, 9).data), d(f.begin(), f.end()) {}
  template <class T>
  std::span<const T> of() const {
    if constexpr (std::is_same_v<T, float>)
      return f;
    else
      return d;
  }
  auto op() const {
    return [this](auto& tape, auto v) {
      using T = std::remove_cvref_t<decltype(*tape.constant(nullptr, {}).value())>;
      return feature_distance<T>(v[0], v[1], of<T>());
    };
  }
};

}  // namespace

TEST_CASE("feature_distance: values equal the formula, each image of a batch for itself") {
  const auto a = uniform({2, 3, 4, 7}, -1, 1, 1), b = uniform({2, 3, 4, 7}, -1, 1, 2);
  const auto w = uniform({7}, 0, 1, 3).data;
  const auto y = op_values(with(w), std::vector{a, b});
  REQUIRE(y.size() == 2);
  for (std::size_t n = 0; n < 2; ++n) {
    double sum = 0;
    for (std::size_t p = n * 12; p < n * 12 + 12; ++p) {
      double na = 0, nb = 0;
      for (std::size_t c = 0; c < 7; ++c) {
        na += a.data[p * 7 + c] * a.data[p * 7 + c];
        nb += b.data[p * 7 + c] * b.data[p * 7 + c];
      }
      for (std::size_t c = 0; c < 7; ++c)
        sum += w[c] * std::pow(a.data[p * 7 + c] / (std::sqrt(na) + 1e-10) -
                                   b.data[p * 7 + c] / (std::sqrt(nb) + 1e-10),
                               2);
    }
    CHECK(y[n] == Approx(sum / 12).epsilon(1e-13));
  }
}

TEST_CASE("feature_distance: pixels without features count as 0 and get no gradient") {
  Tensor<double> a({1, 1, 3, 2}), b({1, 1, 3, 2}), ga(a.shape), gb(a.shape);
  a.data = {0, 0, 0, 0, 3, 4};
  b.data = {0, 0, 0, 2, 6, 8};  // equal, opposite a zero, and in the same direction
  const std::vector<double> w{2, 5};
  Tape<double> tape;
  const auto y = feature_distance<double>(tape.leaf(a, ga), tape.leaf(b, gb), w);
  CHECK(y.value()[0] == Approx(5.0 / 3));
  tape.backward(y);
  CHECK(ga.data[2] == 0);
  CHECK(ga.data[3] == 0);
  for (const auto& g : {ga, gb})
    for (const double v : g.data) CHECK(std::abs(v) < 1e-9);  // unit vectors: no gradient along themselves
}

TEST_CASE("feature_distance: gradient") {
  for (const Shape s : {Shape{0, 2, 2, 3}, Shape{1, 1, 1, 1}, Shape{2, 3, 2, 5}, Shape{1, 2, 2, 19}}) {
    CAPTURE(s.str());
    const auto w = uniform({s[3]}, -1, 2, 3).data;
    expect_grad(with(w), {uniform(s, 0.1, 1, 1), uniform(s, -1, -0.1, 2)});
  }
}

TEST_CASE("feature_distance: errors") {
  Tape<double> tape;
  const Tensor<double> a({1, 2, 2, 3}), b({1, 2, 2, 4}), flat({4, 3}), none({1, 0, 2, 3});
  const std::vector<double> w(3), longer(4);
  CHECK_THROWS_WITH(feature_distance<double>(tape.constant(flat), tape.constant(flat), w),
                    Contains("[feature_distance] a must have rank 4"));
  CHECK_THROWS_WITH(feature_distance<double>(tape.constant(a), tape.constant(b), w),
                    "[feature_distance] b must have the shape of a, [1, 2, 2, 3], got shape [1, 2, 2, 4]");
  CHECK_THROWS_WITH(feature_distance<double>(tape.constant(a), tape.constant(a), longer),
                    Contains("[feature_distance] weights: axis 0 must be 3 (the channels of a"));
  CHECK_THROWS_WITH(feature_distance<double>(tape.constant(none), tape.constant(none), w),
                    Contains("at least one pixel, got shape [1, 0, 2, 3]"));
}

TEST_CASE("feature_distance: float against double, and the same bits for any thread count") {
  const Weights many(17);
  const auto a = uniform<float>({3, 60, 61, 17}, 0, 1, 1), b = uniform<float>({3, 60, 61, 17}, 0, 1, 2);
  expect_same_bits(many.op(), {a, b});
  expect_same_bits(many.op(),
                   {uniform<float>({3, 150, 151, 17}, 0, 1, 1), uniform<float>({3, 150, 151, 17}, 0, 1, 2)});
  CHECK(float_error(many.op(), {a, b}) < 1e-6);
  double worst = 0;
  for (Index e = 1; e <= 130; ++e) {
    const Weights w(e);
    // A single channel always normalises to length 1: its gradient is the rounding error of 0.
    const double error = e == 1 ? 0
                                : float_error(w.op(), {uniform<float>({2, 2, 3, e}, 0, 1, 1),
                                                       uniform<float>({2, 2, 3, e}, 0, 1, 2)});
    raise_to(worst, error);
  }
  CHECK(worst < 2e-6);
}

TEST_CASE("feature_distance: weights may change or be gone when the backward runs") {
  const std::vector<Tensor<double>> in{uniform({1, 2, 2, 3}, 0.1, 1, 1), uniform({1, 2, 2, 3}, 0.1, 1, 2)};
  const auto w = uniform({3}, 0, 1, 3).data;
  const auto gone = [&](auto&, auto v) {
    std::vector<double> weights = w;
    const auto y = feature_distance<double>(v[0], v[1], weights);
    std::ranges::fill(weights, NAN);
    return y;
  };
  CHECK(run_op(gone, in) == run_op(with(w), in));
}
