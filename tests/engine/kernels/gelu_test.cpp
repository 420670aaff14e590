#include "kernels/gelu.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "support/catch.h"
#include "support/each_isa.h"
#include "support/random.h"
#include "support/worst.h"

namespace fieldmark::kernels {
namespace {

// The plain definitions in double.
double distribution(double x) { return std::erfc(-x / std::numbers::sqrt2) / 2; }
double reference(double x) { return x * distribution(x); }
double reference_slope(double x) {
  return distribution(x) + x * std::exp(-x * x / 2) * std::numbers::inv_sqrtpi / std::numbers::sqrt2;
}

template <class T>
double worst_error(Index n, bool add) {
  const auto x = uniform<T>({n + 1}, -6, 6, 1), dy = uniform<T>({n + 1}, -1, 1, 2);
  std::vector<T> y(static_cast<std::size_t>(n) + 2, T(7)), dx = y;
  FIELDMARK_KERNEL(gelu_forward<T>)(x.data.data() + 1, y.data() + 1, n);
  FIELDMARK_KERNEL(gelu_backward<T>)(x.data.data() + 1, dy.data.data() + 1, dx.data() + 1, add, n);
  CHECK((y.front() == 7 && y.back() == 7 && dx.front() == 7 && dx.back() == 7));
  double worst = 0;
  for (std::size_t i = 1; i <= static_cast<std::size_t>(n); ++i) {
    const auto v = static_cast<double>(x.data[i]), g = static_cast<double>(dy.data[i]);
    raise_to(worst, std::abs(static_cast<double>(y[i]) - reference(v)) / std::max(1.0, std::abs(v)));
    raise_to(worst,
             std::abs(static_cast<double>(dx[i]) - (add ? 7 : 0) - g * reference_slope(v)) / (add ? 7 : 1));
  }
  return worst;
}

}  // namespace

TEST_CASE("kernels/gelu: every length and an odd offset, forward and backward") {
  each_isa([] {
    for (Index n = 0; n <= 130; ++n)
      for (const bool add : {false, true}) {
        CAPTURE(n, add);
        CHECK(worst_error<float>(n, add) < 3e-7);
        CHECK(worst_error<double>(n, add) < 1e-15);
      }
  });
}

TEST_CASE("kernels/gelu: the left tail keeps its relative accuracy in float") {
  each_isa([] {
    double worst_value = 0, worst_slope = 0;
    for (float x = -12.5f; x < -1; x += 1e-3f) {
      float y = 0, dx = 0, one = 1;
      FIELDMARK_KERNEL(gelu_forward<float>)(&x, &y, 1);
      FIELDMARK_KERNEL(gelu_backward<float>)(&x, &one, &dx, false, 1);
      raise_to(worst_value, std::abs(static_cast<double>(y) / reference(static_cast<double>(x)) - 1));
      raise_to(worst_slope, std::abs(static_cast<double>(dx) / reference_slope(static_cast<double>(x)) - 1));
    }
    // Worst measured: 6.3e-7 and 9.3e-7.
    CHECK(worst_value < 1e-6);
    CHECK(worst_slope < 1.5e-6);
  });
}

template <class T>
void expect_limits() {
  constexpr T kInfinity = std::numeric_limits<T>::infinity();
  const T x[] = {std::numeric_limits<T>::quiet_NaN(), kInfinity, -kInfinity, 0, -45, 20},
          ones[] = {1, 1, 1, 1, 1, 1};
  T y[6], dx[6];
  FIELDMARK_KERNEL(gelu_forward<T>)(x, y, 6);
  FIELDMARK_KERNEL(gelu_backward<T>)(x, ones, dx, false, 6);
  CHECK((std::isnan(y[0]) && std::isnan(dx[0])));
  CHECK((y[1] == kInfinity && y[2] == 0 && y[3] == 0 && y[4] == 0 && y[5] == 20));
  CHECK((dx[1] == 1 && dx[2] == 0 && dx[3] == T(0.5) && dx[4] == 0 && dx[5] == 1));
}

TEST_CASE("kernels/gelu: NaN stays, infinities go to their limits") {
  each_isa([] {
    expect_limits<float>();
    expect_limits<double>();
  });
}

}  // namespace fieldmark::kernels
