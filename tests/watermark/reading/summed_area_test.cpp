#include "summed_area.h"
#include <fieldmark/core/error.h>

#include <array>
#include <cmath>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using watermark::SummedArea;

TEST_CASE("summed_area: means are integrals over square pixels, whole and cut") {
  const Tensor<float> x = uniform<float>({7, 9, 3}, 0, 1, 4);
  const SummedArea area(x);
  CHECK(area.height() == 7);
  CHECK(area.width() == 9);
  constexpr Index n = 2;
  for (const auto& [left, top, wide, high] :
       {std::array{0., 0., 9., 7.}, {1., 2., 4., 4.}, {0.3, 1.7, 5.5, 3.2}, {6.2, 5.5, 2.8, 1.5}}) {
    std::vector<float> got(n * n * 3);
    area.means(left, top, wide, high, n, got);
    for (Index i = 0; i < n * n; ++i) {
      const double x0 = left + wide * static_cast<double>(i % n) / n, x1 = x0 + wide / n,
                   y0 = top + high * static_cast<double>(i / n) / n, y1 = y0 + high / n;
      for (Index c = 0; c < 3; ++c) {
        double sum = 0;
        for (Index v = 0; v < 7; ++v)
          for (Index u = 0; u < 9; ++u) {
            const auto du = static_cast<double>(u), dv = static_cast<double>(v);
            const double across = std::max(0., std::min(x1, du + 1) - std::max(x0, du)),
                         down = std::max(0., std::min(y1, dv + 1) - std::max(y0, dv));
            sum += across * down * static_cast<double>(x[(v * 9 + u) * 3 + c]);
          }
        const double want = sum * n * n / (wide * high);
        CHECK(std::abs(static_cast<double>(got[static_cast<std::size_t>(3 * i + c)]) - want) < 1e-6);
      }
    }
  }
}

TEST_CASE("summed_area: errors name what is wrong") {
  CHECK_THROWS_AS(SummedArea(Tensor<float>({4, 4})), ShapeError);
  CHECK_THROWS_WITH(SummedArea(Tensor<float>({0, 4, 3})),
                    "[summed_area] image must have at least one pixel, got shape [0, 4, 3]");
  const SummedArea area(Tensor<float>({4, 4, 1}));
  std::vector<float> out(4);
  CHECK_THROWS_AS(area.means(1, 0, 4, 4, 2, out), ValueError);
  CHECK_THROWS_AS(area.means(0, -1, 4, 4, 2, out), ValueError);
  CHECK_THROWS_AS(area.means(0, 0, 4, std::nan(""), 2, out), ValueError);
  CHECK_THROWS_AS(area.means(0, 0, 4, 4, 3, out), ValueError);
}
