#include "kernels/frequency.h"

#include <cmath>
#include <numbers>
#include <vector>

#include "support/each_isa.h"
#include "support/random.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::kernels;

namespace {
// Returns the largest absolute error of sin and cos of 2^b pi x against long double with an exactly reduced
// argument.
template <class T>
double worst_error(const Tensor<T>& x, int dims, int bands) {
  const Index n = x.size() / dims, row = 2 * bands * dims;
  std::vector<T> y(static_cast<std::size_t>(n * row) + 1, T(7));
  FIELDMARK_KERNEL(frequency_forward<T>)(x.data.data(), n, dims, bands, y.data());
  if (y.back() != 7) return HUGE_VAL;  // wrote past the end
  double worst = 0;
  for (Index i = 0; i < n; ++i)
    for (Index b = 0; b < bands; ++b)
      for (Index a = 0; a < dims; ++a) {
        const long double turn =
            std::fmod(std::ldexp(static_cast<long double>(x[i * dims + a]), static_cast<int>(b)), 2.0L);
        const long double angle = std::numbers::pi_v<long double> * turn;
        const T* got = y.data() + i * row + 2 * b * dims + a;
        const auto s = static_cast<double>(std::abs(static_cast<long double>(got[0]) - std::sin(angle)));
        const auto c = static_cast<double>(std::abs(static_cast<long double>(got[dims]) - std::cos(angle)));
        for (const double e : {s, c}) raise_to(worst, e);
      }
  return worst;
}
}  // namespace

TEST_CASE(
    "kernels/frequency: within 2.5e-7 (float) and 3e-16 (double) of the exact value, every count from 1 to "
    "130") {
  each_isa([] {
    for (Index n = 1; n <= 130; ++n) {
      const int dims = static_cast<int>(n % 4) + 1;
      CAPTURE(n, dims);
      CHECK(worst_error(uniform<float>({n, dims}, -2, 2, 1), dims, 16) < 2.5e-7);
      CHECK(worst_error(uniform<double>({n, dims}, -2, 2, 1), dims, 16) < 3e-16);
    }
  });
}

TEST_CASE("kernels/frequency: as exact at 2^15 x far from the origin") {
  each_isa([] {
    for (const double far : {1e2, 1e4, 1e6, 1e9}) {
      CAPTURE(far);
      CHECK(worst_error(uniform<float>({200, 3}, far, far * 1.01, 2), 3, 16) < 2.5e-7);
      CHECK(worst_error(uniform<double>({200, 3}, -far * 1.01, -far, 3), 3, 16) < 3e-16);
    }
  });
}

TEST_CASE("kernels/frequency: exact at multiples of a quarter turn") {
  each_isa([] {
    const Tensor<float> x(Shape{5, 1}, {0, 0.5f, 1, -0.5f, 65536});
    std::vector<float> y(10);
    FIELDMARK_KERNEL(frequency_forward<float>)(x.data.data(), 5, 1, 1, y.data());
    CHECK(y == std::vector<float>{0, 1, 1, 0, 0, -1, -1, 0, 0, 1});
  });
}
