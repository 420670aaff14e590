#include <fieldmark/engine/dual/reduce.h>

#include <array>
#include <cmath>
#include <limits>

#include "support/dual_op.h"

using namespace fieldmark;

namespace {

const Tensor<double> kReduced({2, 3}, {1, 2, 4, -1, 0, 5}), kReducedTangent({2, 3}, {1, 10, 100, 2, 20, 200});
constexpr std::array<double, 6> kReducedWeights{1, 0, 1, 0, 2, 0};
const double kReducedInfinity = std::numeric_limits<double>::infinity();

template <class F>
std::vector<double> reduced_tangent(const F& f, const Tensor<double>& x = kReduced) {
  return jvp([&](auto&, auto q) { return f(q[0]); }, {x}, {kReducedTangent}).product.data;
}

}  // namespace

TEST_CASE("dual/reduce: sums and means of tangents") {
  CHECK(reduced_tangent([](auto x) { return sum(x); }) == std::vector<double>{333});
  CHECK(reduced_tangent([](auto x) { return mean(x); })[0] == Approx(55.5).epsilon(1e-15));
  CHECK(reduced_tangent([](auto x) { return weighted_mean<double>(x, kReducedWeights); })[0] == 141.0 / 4);
  CHECK(reduced_tangent([](auto x) { return sum(x, {0}); }) == std::vector<double>{3, 30, 300});
  CHECK(reduced_tangent([](auto x) { return mean(x, {-1}, KeepAxes::yes); })[1] == Approx(74).epsilon(1e-15));
}

TEST_CASE("dual/reduce: the variance") {
  // Means 7/3 and 4/3.
  const auto t = reduced_tangent([](auto x) { return variance(x, {1}); });
  CHECK(t[0] == Approx(2.0 / 3 * (-4.0 / 3 * 1 - 1.0 / 3 * 10 + 5.0 / 3 * 100)).epsilon(1e-14));
  CHECK(t[1] == Approx(2.0 / 3 * (-7.0 / 3 * 2 - 4.0 / 3 * 20 + 11.0 / 3 * 200)).epsilon(1e-14));
}

TEST_CASE("dual/reduce: the largest, the first of equals") {
  CHECK(reduced_tangent([](auto x) { return max(x, {0}); }) == std::vector<double>{1, 10, 200});
  CHECK(reduced_tangent([](auto x) { return max(x, {1}, KeepAxes::yes); }) == std::vector<double>{100, 200});
  CHECK(reduced_tangent([](auto x) { return max(x, {0, 1}); }) == std::vector<double>{200});
  CHECK(reduced_tangent([](auto x) { return max(x, {1}); }, Tensor<double>({2, 3}, {7, 7, 1, 0, 3, 3})) ==
        std::vector<double>{1, 20});
}

TEST_CASE("dual/reduce: softmax and logsumexp against their formulas, also far out") {
  for (const double shift : {0.0, 800.0, -800.0}) {
    Tensor<double> x = kReduced;
    for (double& v : x.data) v += shift;
    const auto lse = reduced_tangent([](auto q) { return logsumexp(q, {1}); }, x);
    const auto rows = reduced_tangent([](auto q) { return softmax(q); }, x);
    CHECK(reduced_tangent([](auto q) { return softmax(q, 1); }, x) == rows);
    for (Index r = 0; r < 2; ++r) {
      double z = 0, along = 0;
      for (Index c = 0; c < 3; ++c) z += std::exp(kReduced[r * 3 + c]);
      for (Index c = 0; c < 3; ++c) along += std::exp(kReduced[r * 3 + c]) / z * kReducedTangent[r * 3 + c];
      CHECK(lse[at(r)] == Approx(along).epsilon(1e-12));
      for (Index c = 0; c < 3; ++c)
        CHECK(rows[at(r * 3 + c)] ==
              Approx(std::exp(kReduced[r * 3 + c]) / z * (kReducedTangent[r * 3 + c] - along))
                  .epsilon(1e-12)
                  .margin(1e-13));
    }
  }
}

TEST_CASE("dual/reduce: logsumexp of -infinity alone has a tangent of 0, as its gradient is") {
  const Tensor<double> x({2, 3}, {-kReducedInfinity, -kReducedInfinity, -kReducedInfinity, -kReducedInfinity,
                                  0, -kReducedInfinity});
  CHECK(reduced_tangent([](auto q) { return logsumexp(q, {1}); }, x) == std::vector<double>{0, 20});
}

TEST_CASE("dual/reduce: softmax along another axis") {
  const auto f = [](auto x) { return softmax(x, 0); };
  const auto t = reduced_tangent(f);
  const double p = std::exp(1) / (std::exp(1) + std::exp(-1));
  CHECK(t[0] == Approx(p * (1 - p) * (1 - 2)).epsilon(1e-14));
  CHECK(t[3] == Approx(p * (1 - p) * (2 - 1)).epsilon(1e-14));
}

TEST_CASE("dual/reduce: in float as in double") {
  const std::vector<Tensor<float>> in{uniform<float>({5, 7}, -2, 2, 1)};
  const auto check = [&](const auto& f) {
    CHECK(float_products_error([&](auto&, auto v) { return f(v[0]); }, in) < 1e-5);
  };
  check([](auto x) { return mul(sum(x), mean(x)); });
  check([](auto x) { return mul(sum(x, {1}, KeepAxes::yes), mean(x, {0})); });
  check([](auto x) { return variance(x, {0}); });
  check([](auto x) { return mul(max(x, {1}, KeepAxes::yes), logsumexp(x, {0})); });
  check([](auto x) { return add(softmax(x), softmax(x, 0)); });
}
