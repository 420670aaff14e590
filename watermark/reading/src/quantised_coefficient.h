#pragma once
// The likelihood of a render's coefficient, given the step to which JPEG rounded the image's. Private.
#include <cmath>
#include <numbers>

namespace fieldmark::watermark {

constexpr double kOutlier = 0.02;    // share of outlier coefficients ...
constexpr double kOutlierWay = 512;  // ... and their range in levels

/// Where the interval that is rounded to n steps lies around the render's coefficient b, in standard
/// deviations.
struct RoundingInterval {
  /// @param step, b, deviation  levels; step and deviation positive
  RoundingInterval(double n, double step, double b, double deviation)
      : low(((n - 0.5) * step - b) / deviation), high(((n + 0.5) * step - b) / deviation) {}
  double low, high;
};

/// Returns P(n | b), at least kOutlier / kOutlierWay times the step: a normal distribution of the image's
/// coefficient around b, with outliers.
inline double probability(const RoundingInterval& i, double step) {
  // Subtracts two small tails instead of two numbers near 1.
  const bool above = i.low + i.high > 0;
  const double near = above ? i.low : -i.high, far = above ? i.high : -i.low;
  const double p = 0.5 * (std::erfc(near / std::numbers::sqrt2) - std::erfc(far / std::numbers::sqrt2));
  return (1 - kOutlier) * p + kOutlier * step / kOutlierWay;
}

/// Returns d log P(n | b) / db: the difference of the bell curve at both ends, over P.
/// @param i, step  as of probability()   @param deviation  of the interval, levels
inline double log_slope(const RoundingInterval& i, double step, double deviation) {
  const double bells = std::exp(-0.5 * i.low * i.low) - std::exp(-0.5 * i.high * i.high);
  return (1 - kOutlier) * bells / (std::sqrt(2 * std::numbers::pi) * deviation * probability(i, step));
}

/// The logarithm of a product of probabilities, which takes few logarithms.
class LogProduct {
 public:
  /// @param p  1e-100 or more
  void times(double p) {
    product_ *= p;
    if (product_ < 1e-200) take();
  }
  double value() const { return sum_ + std::log(product_); }

 private:
  void take() {
    sum_ = value();
    product_ = 1;
  }
  double sum_ = 0, product_ = 1;
};

}  // namespace fieldmark::watermark
