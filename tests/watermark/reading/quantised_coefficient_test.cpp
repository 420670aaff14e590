#include "quantised_coefficient.h"

#include <cmath>
#include <numbers>

#include "support/catch.h"

using namespace fieldmark::watermark;

namespace {

// The same by the midpoint rule.
double integrated(double n, double step, double b, double deviation) {
  constexpr int kSteps = 20000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double x = ((n - 0.5 + (i + 0.5) / kSteps) * step - b) / deviation;
    sum += std::exp(-0.5 * x * x) * step / (kSteps * deviation * std::sqrt(2 * std::numbers::pi));
  }
  return (1 - kOutlier) * sum + kOutlier * step / kOutlierWay;
}

}  // namespace

TEST_CASE("quantised_coefficient: probabilities are integrals of a normal density, with outliers") {
  for (const double n : {-3., 0., 2.})
    for (const double step : {1., 16., 99.})
      for (const double b : {-40., 0.3, 31.})
        for (const double deviation : {0.3, 5., 39.}) {
          CAPTURE(n, step, b, deviation);
          const double p = probability({n, step, b, deviation}, step),
                       want = integrated(n, step, b, deviation);
          CHECK(std::abs(p - want) < 1e-5 * want);
          CHECK(p >= kOutlier / kOutlierWay * step);
        }
}

TEST_CASE("quantised_coefficient: probabilities of all steps add up to one, without the outliers") {
  for (const double deviation : {0.3, 5., 39.}) {
    double sum = 0;
    for (int n = -60; n <= 60; ++n)
      sum += probability({static_cast<double>(n), 7, 2.5, deviation}, 7) - kOutlier * 7 / kOutlierWay;
    CHECK(std::abs(sum - (1 - kOutlier)) < 1e-12);
  }
}

TEST_CASE("quantised_coefficient: slopes are differences of log probabilities") {
  for (const double n : {-3., 0., 2.})
    for (const double step : {4., 16.})
      for (const double b : {-40., 0.3, 31.})
        for (const double deviation : {2., 5., 39.}) {
          CAPTURE(n, step, b, deviation);
          constexpr double h = 1e-4;
          const auto log_p = [&](double at) { return std::log(probability({n, step, at, deviation}, step)); };
          const double want = (log_p(b + h) - log_p(b - h)) / (2 * h);
          CHECK(std::abs(log_slope({n, step, b, deviation}, step, deviation) - want) <
                1e-8 + 1e-6 * std::abs(want));
        }
}

TEST_CASE("quantised_coefficient: the logarithm of a product is that of products below the least double") {
  LogProduct product;
  CHECK(product.value() == 0);
  double want = 0;
  for (int i = 1; i <= 1000; ++i) {
    const double p = 4e-5 + 1e-6 * i;
    product.times(p);
    want += std::log(p);
  }
  for (int i = 0; i < 5; ++i) product.times(1e-100);
  want += 5 * std::log(1e-100);
  REQUIRE(want < -8000);
  CHECK(std::abs(product.value() - want) < 1e-12 * std::abs(want));
}
