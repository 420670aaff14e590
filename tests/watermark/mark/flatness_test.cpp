#include <fieldmark/watermark/mark/flatness.h>

#include <cmath>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("flatness: 1 on a plain surface, small across an edge, 0 outside the foreground") {
  CachedView view;
  view.height = view.width = 16;
  view.base = Tensor<float>({16, 16, 3}, 0.5f);
  for (Index y = 0; y < 16; ++y)
    for (Index x = 8; x < 16; ++x) view.base[3 * (16 * y + x) + 1] = 0.6f;
  std::vector<float> foreground(256, 1.f);
  foreground[0] = 0;
  const auto flat = flatness(view, foreground);
  REQUIRE(flat.size() == 3 * 256);
  const auto of_pixel = [&](std::size_t y, std::size_t x) {
    return static_cast<double>(flat[3 * (16 * y + x) + 1]);
  };
  CHECK(of_pixel(0, 0) == 0);
  CHECK(of_pixel(5, 3) == Approx(1).epsilon(1e-4));
  CHECK(of_pixel(5, 13) == Approx(1).epsilon(1e-4));
  // Two of five columns lie beyond the edge: a variance of 0.1^2 * 2/5 * 3/5.
  CHECK(of_pixel(5, 7) == Approx(std::exp(-0.0024 / 0.0009)).epsilon(1e-3));
  for (std::size_t i = 0; i < flat.size(); i += 3) CHECK((flat[i] == flat[i + 1] && flat[i] == flat[i + 2]));
}
