#include "surround.h"

#include <fieldmark/core/error.h>

#include <cmath>

#include "support/catch.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

// Returns a disc of many colours in the middle of a background.
Tensor<float> disc(Index h, Index w, const std::array<float, 3>& background) {
  Tensor<float> image({h, w, 3});
  for (Index p = 0; p < h * w; ++p) {
    const double y = static_cast<double>(p / w) - 0.5 * static_cast<double>(h),
                 x = static_cast<double>(p % w) - 0.5 * static_cast<double>(w);
    const bool inside = std::hypot(x, y) < 0.35 * static_cast<double>(h);
    for (Index a = 0; a < 3; ++a)
      image[3 * p + a] = inside ? 0.3f + 0.4f * static_cast<float>((p + a) % 7) / 7
                                : background[static_cast<std::size_t>(a)];
  }
  return image;
}

Tensor<float> with_bars(const Tensor<float>& image, Index rows, Index columns, float level) {
  const Index h = image.shape[0], w = image.shape[1];
  Tensor<float> out({h + 2 * rows, w + 2 * columns, 3}, level);
  for (Index y = 0; y < h; ++y)
    std::copy_n(&image[3 * y * w], 3 * w, &out[3 * ((y + rows) * (w + 2 * columns) + columns)]);
  return out;
}

}  // namespace

TEST_CASE("surround: an image before the field's background is left as it is") {
  const Tensor<float> image = disc(60, 80, {1, 1, 1});
  const Surround seen = clear_surround(image, 1, true);
  CHECK(seen.image.data == image.data);
  CHECK(seen.plain.size() == 0);
  CHECK(clear_surround(Tensor<float>({20, 30, 3}, 0.4f), 1, false).image.data ==
        Tensor<float>({20, 30, 3}, 0.4f).data);
}

TEST_CASE("surround: bars at opposite edges are cut off, one plain side is not") {
  const Tensor<float> image = disc(60, 80, {1, 1, 1});
  for (const bool object : {true, false}) {
    Surround seen = clear_surround(with_bars(image, 0, 20, 0), 1, object);
    CHECK(seen.left == 20);
    CHECK(seen.top == 0);
    CHECK(seen.image.shape == image.shape);
    CHECK(seen.image.data == image.data);
    seen = clear_surround(with_bars(image, 7, 0, 0.2f), 1, object);
    CHECK(seen.top == 7);
    CHECK(seen.image.data == image.data);
  }
  Tensor<float> sky = disc(60, 80, {0.5f, 0.6f, 0.7f});
  for (Index i = 0; i < 3 * 80 * 10; ++i) sky[i] = 0.9f;
  for (Index i = 3 * 80 * 50; i < sky.size(); ++i) sky[i] = static_cast<float>(i % 11) / 11;
  CHECK(clear_surround(sky, 1, false).image.data == sky.data);
}

TEST_CASE("surround: another background behind an object becomes the field's, bars around it or not") {
  const Tensor<float> want = disc(60, 80, {1, 1, 1});
  for (const std::array<float, 3> colour :
       {std::array<float, 3>{0, 0, 0}, {0, 0.8f, 0.1f}, {0.9f, 0.9f, 0.2f}}) {
    const Tensor<float> image = disc(60, 80, colour);
    const Surround seen = clear_surround(image, 1, true);
    for (std::size_t a = 0; a < 3; ++a) CHECK(seen.colour[a] == Approx(colour[a]).margin(1e-5));
    REQUIRE(seen.plain.size() == seen.image.size());
    for (Index i = 0; i < 3; ++i) CHECK(seen.image[i] == 1);
    CHECK(own_image(seen).data == seen.plain.data);
    // Bars of the background's own colour become its edges: the disc stays, wherever the cut is.
    const Index h = seen.image.shape[0], w = seen.image.shape[1];
    double worst = 0;
    for (Index y = 0; y < h; ++y)
      for (Index x = 0; x < 3 * w; ++x) {
        const float off = seen.image[3 * y * w + x] - want[3 * ((y + seen.top) * 80 + seen.left) + x];
        raise_to(worst, std::abs(static_cast<double>(off)));
      }
    CHECK(worst == 0);
    CHECK(clear_surround(image, 1, false).plain.size() == 0);
  }
}

TEST_CASE("surround: a bar from edge to edge covers the object, and is no background") {
  const Tensor<float> view = disc(60, 80, {1, 1, 1});
  Tensor<float> image = view;
  for (Index i = 3 * 80 * 24; i < 3 * 80 * 36; ++i) image[i] = 0;
  for (Index x = 90; x < 120; ++x) image[3 * 80 * 30 + x] = 1;  // letters on the bar
  const Surround seen = clear_surround(image, 1, true);
  REQUIRE(std::ssize(seen.covered) == 60 * 80);
  for (Index p = 0; p < 60 * 80; ++p) {
    const bool bar = p / 80 >= 24 && p / 80 < 36;
    REQUIRE(seen.covered[static_cast<std::size_t>(p)] == (bar ? 1 : 0));
    REQUIRE(seen.image[3 * p] == (bar ? 1 : view[3 * p]));
  }
  CHECK(clear_surround(view, 1, true).covered.empty());
  CHECK(clear_surround(image, 1, false).covered.empty());
}

TEST_CASE("surround: with the opacity known, edges too are as before the field's background") {
  Tensor<float> plain({1, 3, 3}), opacity({1, 3});
  const float object = 0.6f, level[] = {0, 0.25f, 1};
  const std::array<float, 3> colour{0.1f, 0.4f, 0};
  for (Index p = 0; p < 3; ++p) {
    opacity[p] = level[p];
    for (Index a = 0; a < 3; ++a)
      plain[3 * p + a] = level[p] * object + (1 - level[p]) * colour[static_cast<std::size_t>(a)];
  }
  const Tensor<float> y = before_background(plain, opacity, colour, {1, 1, 1});
  for (Index i = 0; i < y.size(); ++i)
    CHECK(y[i] == Approx(level[i / 3] * object + (1 - level[i / 3])).margin(1e-6));
  CHECK_THROWS_AS(before_background(plain, Tensor<float>({1, 2}), colour, {1, 1, 1}), ShapeError);
}

TEST_CASE("surround: errors name what is wrong") {
  CHECK_THROWS_WITH(clear_surround(Tensor<float>({4, 4}), 1, true), Contains("image must have rank 3"));
}
