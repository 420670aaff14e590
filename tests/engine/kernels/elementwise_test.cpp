#include "kernels/elementwise.h"

#include <cmath>
#include <limits>
#include <vector>

#include "support/catch.h"
#include "support/each_isa.h"
#include "support/random.h"
#include "support/worst.h"

namespace fieldmark::kernels {
namespace {

constexpr Unary kAll[] = {Unary::relu, Unary::sigmoid,       Unary::tanh,
                          Unary::exp,  Unary::truncated_exp, Unary::softplus};

// The plain definitions in double.
double reference(Unary f, double x) {
  switch (f) {
    case Unary::relu:
      return std::max(x, 0.0);
    case Unary::sigmoid:
      return 1 / (1 + std::exp(-x));
    case Unary::tanh:
      return std::tanh(x);
    case Unary::exp:
      return std::exp(x);
    case Unary::truncated_exp:
      return std::exp(std::min(x, 15.0));
    default:
      return x > 40 ? x : std::log1p(std::exp(x));
  }
}
double reference_slope(Unary f, double x) {
  const double s = reference(Unary::sigmoid, x);
  switch (f) {
    case Unary::relu:
      return x > 0;
    case Unary::sigmoid:
      return s * (1 - s);
    case Unary::tanh:
      return 1 / (std::cosh(x) * std::cosh(x));
    case Unary::softplus:
      return s;
    default:
      return reference(f, x);
  }
}

}  // namespace

TEST_CASE("kernels/elementwise: every length and an odd offset, forward and backward") {
  each_isa([] {
    for (Unary f : kAll)
      for (std::int64_t n = 0; n <= 130; ++n) {
        const auto x = uniform<float>({n + 1}, -6, 6, 1), dy = uniform<float>({n + 1}, -1, 1, 2);
        std::vector<float> y(static_cast<std::size_t>(n) + 2, 7.f), dx = y, held = y;
        FIELDMARK_KERNEL(unary_forward<float>)(f, x.data.data() + 1, y.data() + 1, n);
        const auto backward = FIELDMARK_KERNEL(unary_backward<float>);
        backward(f, x.data.data() + 1, y.data() + 1, dy.data.data() + 1, dx.data() + 1, false, n);
        backward(f, x.data.data() + 1, y.data() + 1, dy.data.data() + 1, held.data() + 1, true, n);
        double worst = 0;
        for (std::size_t i = 1; i <= static_cast<std::size_t>(n); ++i) {
          const double v = x.data[i], slope = dy.data[i] * reference_slope(f, v), want = reference(f, v);
          raise_to(worst, std::abs(y[i] - want) / std::max(1.0, want));
          raise_to(worst, std::abs(dx[i] - slope) / std::max(1.0, std::abs(slope)));
          raise_to(worst, std::abs(held[i] - 7 - slope) / std::max(7.0, std::abs(slope)));
        }
        CAPTURE(static_cast<int>(f), n);
        CHECK(worst < 4e-7);
        CHECK((y.front() == 7 && y.back() == 7 && dx.front() == 7 && dx.back() == 7));
      }
  });
}

TEST_CASE("kernels/elementwise: relative error of the float path against double") {
  // Worst measured at v2 and v3: sigmoid 3.1e-7, tanh 1.7e-7, exp 2.45e-7, softplus 3.05e-7.
  struct Range {
    Unary f;
    double lo, hi, bound;
  };
  each_isa([] {
    for (const Range r :
         {Range{Unary::sigmoid, -87.3, 100, 4e-7}, Range{Unary::tanh, -30, 30, 3e-7},
          Range{Unary::tanh, -1e-3, 1e-3, 3e-7}, Range{Unary::exp, -87.3, 88, 3e-7},
          Range{Unary::truncated_exp, -87.3, 100, 3e-7}, Range{Unary::softplus, -87.3, 100, 4e-7}}) {
      std::vector<float> x, y(200001);
      for (int i = 0; i <= 200000; ++i) x.push_back(static_cast<float>(r.lo + (r.hi - r.lo) * i / 200000));
      FIELDMARK_KERNEL(unary_forward<float>)(r.f, x.data(), y.data(), 200001);
      double worst = 0;
      for (std::size_t i = 0; i < x.size(); ++i) {
        const double want = reference(r.f, x[i]);
        if (want != 0) raise_to(worst, std::abs(y[i] - want) / std::abs(want));
      }
      CAPTURE(static_cast<int>(r.f), worst);
      CHECK(worst < r.bound);
    }
  });
}

TEST_CASE("kernels/elementwise: the float limits, infinities and NaN") {
  constexpr float inf = std::numeric_limits<float>::infinity(), top = 1.6516363e38f, e15 = 3269017.25f;
  const std::vector<float> x{-inf, -100, -88, 0, 88, 100, inf, std::numeric_limits<float>::quiet_NaN()};
  const std::vector<std::vector<float>> want{
      {0, 0, 0, 0, 88, 100, inf},  {0, 0, 0, 0.5f, 1, 1, 1},    {-1, -1, -1, 0, 1, 1, 1},
      {0, 0, 0, 1, top, top, top}, {0, 0, 0, 1, e15, e15, e15}, {0, 0, 0, 0.69314718f, 88, 100, inf}};
  each_isa([&] {
    for (Unary f : kAll) {
      std::vector<float> y(x.size());
      FIELDMARK_KERNEL(unary_forward<float>)(f, x.data(), y.data(), static_cast<std::int64_t>(x.size()));
      const auto& w = want[static_cast<std::size_t>(f)];
      CAPTURE(static_cast<int>(f), y);
      for (std::size_t i = 0; i < w.size(); ++i)
        CHECK((y[i] == w[i] || std::abs(y[i] - w[i]) < 3e-7f * std::abs(w[i])));
      CHECK(std::isnan(y.back()));
    }
  });
}

TEST_CASE("kernels/elementwise: sum of exponentials") {
  each_isa([] {
    for (std::int64_t n = 0; n <= 130; ++n) {
      const auto x = uniform<float>({n + 1}, -20, 3, 5);
      std::vector<float> y(static_cast<std::size_t>(n) + 2, 7.f);
      const float got = FIELDMARK_KERNEL(exp_sum<float>)(x.data.data() + 1, 3.f, y.data() + 1, n);
      double sum = 0, worst = 0;
      for (std::size_t i = 1; i <= static_cast<std::size_t>(n); ++i) {
        const double e = std::exp(static_cast<double>(x.data[i] - 3.f));
        raise_to(worst, std::abs(y[i] - e) / e);
        sum += e;
      }
      CAPTURE(n);
      CHECK(worst < 2e-7);
      CHECK(std::abs(got - sum) <= 1e-6 * sum);
      CHECK((y.front() == 7 && y.back() == 7));
    }
  });
}

}  // namespace fieldmark::kernels
