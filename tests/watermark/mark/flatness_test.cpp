#include <fieldmark/watermark/mark/flatness.h>

#include <cmath>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("flatness: the flat share of views is the mean over what they show") {
  CachedView plain, striped, empty;
  for (CachedView* v : {&plain, &striped, &empty}) {
    v->height = v->width = 16;
    v->base = Tensor<float>({16, 16, 3}, 0.5f);
    v->opacity = Tensor<float>({16, 16}, v == &empty ? 0.f : 1.f);
    for (std::int32_t p = 0; p <= 256; ++p) v->sample_begin.push_back(v == &empty ? 0 : p);
  }
  for (Index p = 0; p < 256; p += 2) striped.base[3 * p + 1] = 1;
  CHECK(flat_share(std::vector{plain}) == Approx(1).epsilon(1e-6));
  CHECK(flat_share(std::vector{striped}) == Approx(0).margin(1e-6));
  for (Index p = 128; p < 256; ++p) striped.opacity[p] = 0;
  CHECK(flat_share(std::vector{plain, striped, empty}) == Approx(2.0 / 3).epsilon(1e-6));
  CHECK(flat_share(std::vector{empty}) == 0);
  CHECK(flat_share({}) == 0);
}

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
