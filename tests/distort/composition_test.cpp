#include "composition.h"

#include <fieldmark/distort/distortion.h>

#include <cmath>
#include <set>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::distort;

namespace {
const std::vector<float> kWhite(3, 1.f);

Tensor<float> distorted_by(const char* name, const Tensor<float>& x, PixelMap* source = nullptr) {
  return apply_distortion(parse_distortion(name), x, CounterRng(1, 1), 0, kWhite, source);
}

// Checks a distortion that only moves whole pixels: each pixel equals that at its source position.
void check_moved(const char* name, const Tensor<float>& x, Index moved) {
  CAPTURE(name);
  PixelMap source;
  const Tensor<float> y = distorted_by(name, x, &source);
  Index compared = 0;
  for (Index v = 0; v < y.shape[0]; ++v)
    for (Index u = 0; u < y.shape[1]; ++u) {
      const auto from = source(static_cast<double>(u), static_cast<double>(v));
      const Index column = std::lround(from[0]), row = std::lround(from[1]);
      if (column < 0 || row < 0 || column >= x.shape[1] || row >= x.shape[0]) {
        CHECK(y[3 * (v * y.shape[1] + u)] == 0);  // a bar
        continue;
      }
      for (Index c = 0; c < 3; ++c)
        REQUIRE(y[3 * (v * y.shape[1] + u) + c] ==
                Approx(x[3 * (row * x.shape[1] + column) + c]).margin(0.002));
      ++compared;
    }
  CHECK(compared == moved);
}
}  // namespace

TEST_CASE("composition: mirror and bars move whole pixels to where they say") {
  const Tensor<float> x = uniform<float>({18, 22, 3}, 0.1, 1, 1);
  check_moved("mirror", x, 18 * 22);
  check_moved("pillarbox", x, 18 * 22);
  check_moved("letterbox", x, 18 * 22);
  CHECK(pillarboxed(x).shape == Shape{18, 32, 3});
  CHECK(letterboxed(Tensor<float>({10, 48, 3})).shape == Shape{85, 48, 3});
  CHECK(distorted_by("mirror,mirror", x).data == distorted_by("noise_0", x).data);
}

TEST_CASE("composition: a stretched image is wider, and back it is nearly the same") {
  const Tensor<float> x = uniform<float>({10, 12, 3}, 0, 1, 2);
  const Tensor<float> wide = distorted_by("stretch_1.5", x);
  CHECK(wide.shape == Shape{10, 18, 3});
  CHECK(distorted_by("stretch_2,stretch_0.5", x).data == distorted_by("noise_0", x).data);
}

TEST_CASE("composition: another background goes behind the pixels that differ from the old one") {
  Tensor<float> x({4, 5, 3}, 1.f);
  for (Index c = 0; c < 3; ++c) x[3 * 7 + c] = 0.25f;
  x[3 * 8] = 0.99f;  // an edge: two and a half levels from white
  const Tensor<float> black = distorted_by("background_black", x),
                      noise = distorted_by("background_noise", x);
  const Tensor<float> shapes = distorted_by("background_shapes", x);
  std::set<float> values(noise.data.begin(), noise.data.end());
  CHECK(values.size() > 20);
  for (Index p = 0; p < 20; ++p) {
    const bool object = p == 7 || p == 8;
    if (object) CHECK(shapes[3 * p] == Approx(x[3 * p]).margin(0.002));
    for (Index c = 0; c < 3; ++c)
      CHECK(black[3 * p + c] == (object ? Approx(x[3 * p + c]).margin(0.002) : Approx(0)));
  }
  CHECK(distorted_by("background_white", x).data == distorted_by("noise_0", x).data);
  CHECK(distorted_by("background_green", x)[0] == Approx(0.1).margin(0.002));
  CHECK(distorted_by("background_grey", x)[0] == Approx(0.5).margin(0.002));
}

TEST_CASE("composition: dead leaves have edges and plain areas of all sizes") {
  const CounterRng rng(3, 1);
  const Tensor<float> y =
      dead_leaves(128, 128, [&](Index i) { return rng.uniform4(0, static_cast<std::uint64_t>(i)); });
  // Mean squares of the differences between pixels at a distance double slower than the distance: white noise
  // would have the same at any, a ramp four times as much.
  double previous = 0;
  for (const Index apart : {1, 2, 4, 8, 16}) {
    double sum = 0;
    for (Index row = 0; row < 128; ++row)
      for (Index x = 0; x + apart < 128; ++x)
        for (Index c = 0; c < 3; ++c)
          sum += std::pow(
              static_cast<double>(y[3 * (128 * row + x) + c] - y[3 * (128 * row + x + apart) + c]), 2);
    sum /= static_cast<double>(3 * 128 * (128 - apart));
    if (apart > 1) CHECK(sum > 1.1 * previous);
    if (apart > 1) CHECK(sum < 2.2 * previous);
    previous = sum;
  }
  double mean = 0;
  Index uncovered = 0;
  for (Index p = 0; p < 128 * 128; ++p) {
    mean += static_cast<double>(y[3 * p]) / (128 * 128);
    uncovered += y[3 * p] == 0.5f && y[3 * p + 1] == 0.5f && y[3 * p + 2] == 0.5f;
  }
  CHECK(mean > 0.3);
  CHECK(mean < 0.7);
  CHECK(uncovered < 128 * 128 / 50);
}

TEST_CASE("composition: a caption covers the middle fifth, a collage holds four of half the size") {
  const Tensor<float> x({50, 40, 3}, 0.5f);
  const Tensor<float> caption = captioned(x);
  Index covered = 0;
  for (Index p = 0; p < 50 * 40; ++p) covered += caption[3 * p] != 0.5f;
  CHECK(covered == 10 * 40);
  CHECK(caption[3 * 20 * 40] == 0);
  CHECK(caption[3 * 19 * 40] == 0.5f);
  const Tensor<float> y = uniform<float>({20, 30, 3}, 0, 1, 3), four = collage(y);
  CHECK(four.shape == y.shape);
  for (Index row = 0; row < 20; ++row)
    for (Index i = 0; i < 90; ++i) {
      const Index from = 2 * 90 * (row % 10) + 6 * (i / 3 % 15) + i % 3;  // of 2 x 2 pixels
      CHECK(four[90 * row + i] ==
            Approx((y[from] + y[from + 3] + y[from + 90] + y[from + 93]) / 4).margin(1e-6));
    }
}

namespace {

// Returns grey levels between 0.2 and 0.7 on an L-shaped object before white.
Tensor<float> l_shape() {
  Tensor<float> x = uniform<float>({24, 32, 3}, 0.2f, 0.7f, 6);
  for (Index row = 0; row < 24; ++row)
    for (Index column = 0; column < 32; ++column)
      if (row < 4 || row >= 20 || column < 6 || column >= 26 || (row < 12 && column >= 10))
        std::fill_n(&x[3 * (row * 32 + column)], 3, 1.f);
  return x;
}

Index object_pixels(const Tensor<float>& x, Index top, Index left, Index height, Index width) {
  Index count = 0;
  for (Index row = top; row < top + height; ++row)
    for (Index column = left; column < left + width; ++column)
      count += !is_background(&x[3 * (row * x.shape[1] + column)], kWhite);
  return count;
}

}  // namespace

TEST_CASE("composition: the quarters of an object share its pixels") {
  const Tensor<float> x = l_shape();
  const Index all = object_pixels(x, 0, 0, 24, 32);
  for (const float order : {0.f, 0.9f}) {
    Index sum = 0;
    for (const float u : {0.f, 0.25f, 0.5f, 0.9999f}) {
      CAPTURE(u, order);
      const PastedPart part = quarter_of_object(x, kWhite, 0.5, {u, 0.3f, 0.9f, order});
      const Index pixels = object_pixels(x, part.top, part.left, part.height, part.width);
      sum += pixels;
      // It is tight: its first and last rows and columns show the object.
      CHECK(object_pixels(x, part.top, part.left, 1, part.width) > 0);
      CHECK(object_pixels(x, part.top + part.height - 1, part.left, 1, part.width) > 0);
      CHECK(object_pixels(x, part.top, part.left, part.height, 1) > 0);
      CHECK(object_pixels(x, part.top, part.left + part.width - 1, part.height, 1) > 0);
      CHECK(std::abs(4 * static_cast<double>(pixels) / static_cast<double>(all) - 1) <
            0.3);  // of whole lines
      CHECK(part.to_height == std::llround(0.5 * static_cast<double>(part.height)));
      CHECK(part.to_width == std::llround(0.5 * static_cast<double>(part.width)));
      CHECK(part.to_top + part.to_height <= 24);
      CHECK(part.to_left + part.to_width <= 32);
    }
    CHECK(sum == all);
  }
}

TEST_CASE("composition: a pasted part covers what is behind it with the object alone") {
  const Tensor<float> x = l_shape(), behind = uniform<float>({24, 32, 3}, 0, 1, 7);
  const PastedPart part{4, 6, 16, 20, 2, 9, 16, 20};
  const Tensor<float> y = pasted(x, kWhite, part, behind);
  for (Index row = 0; row < 24; ++row)
    for (Index column = 0; column < 32; ++column) {
      const bool inside = row >= 2 && row < 18 && column >= 9 && column < 29;
      const Index from = (row + 2) * 32 + column - 3, to = row * 32 + column;
      const bool object = inside && !is_background(&x[3 * from], kWhite);
      for (Index c = 0; c < 3; ++c) CHECK(y[3 * to + c] == (object ? x[3 * from + c] : behind[3 * to + c]));
    }
  // At half the size, a pixel half covered shows half of each.
  const Tensor<float> flat({4, 4, 3}, 0.25f);
  Tensor<float> half = flat;
  std::fill_n(half.data.begin(), 24, 1.f);
  const Tensor<float> small = pasted(half, kWhite, {1, 0, 2, 4, 0, 0, 1, 2}, Tensor<float>({4, 4, 3}, 0.75f));
  CHECK(small[0] == Approx(0.5));
  CHECK(small[6] == 0.75f);
}

TEST_CASE("composition: a part tells where its pixels came from, at any size") {
  // Red and green are the coordinates of an object of 60 x 40 pixels before white.
  Tensor<float> x({70, 90, 3}, 1.f);
  for (Index row = 10; row < 50; ++row)
    for (Index column = 20; column < 80; ++column) {
      float* pixel = &x[3 * (row * 90 + column)];
      pixel[0] = static_cast<float>(column) / 255;
      pixel[1] = static_cast<float>(row) / 255;
      pixel[2] = 0;
    }
  for (const char* name : {"part_1", "part_0.5", "part_0.7,scale_2"}) {
    CAPTURE(name);
    PixelMap source;
    const Tensor<float> y = distorted_by(name, x, &source);
    const double kept = (source.kept[2] - source.kept[0]) * (source.kept[3] - source.kept[1]);
    CHECK(kept == 30 * 20);
    const PixelMap to = source.inverse();
    double worst = 0;
    Index seen = 0;
    for (Index v = 0; v < y.shape[0]; ++v)
      for (Index u = 0; u < y.shape[1]; ++u) {
        const auto from = source(static_cast<double>(u), static_cast<double>(v));
        // Pixels inside, not those that the edge shares.
        if (!source.keeps(from[0] - 2, from[1] - 2) || !source.keeps(from[0] + 2, from[1] + 2)) continue;
        ++seen;
        const float* got = &y[3 * (v * y.shape[1] + u)];
        worst = std::max({worst, std::abs(255 * static_cast<double>(got[0]) - from[0]),
                          std::abs(255 * static_cast<double>(got[1]) - from[1])});
        const auto again = to(from[0], from[1]);
        CHECK(std::hypot(again[0] - static_cast<double>(u), again[1] - static_cast<double>(v)) < 1e-9);
      }
    CHECK(seen > 80);
    CHECK(worst < 1.1);  // half a level of rounding a step
  }
}

TEST_CASE("composition: what a part keeps survives later crops and turns") {
  Tensor<float> x({40, 40, 3}, 1.f);
  for (Index p = 0; p < 40 * 40; ++p)
    if (p % 40 >= 8 && p % 40 < 32 && p / 40 >= 8 && p / 40 < 32) x[3 * p] = 0;
  PixelMap part, later;
  distorted_by("part_1", x, &part);
  distorted_by("part_1,crop_0.5,mirror", x, &later);
  CHECK(part.kept == later.kept);
  CHECK(later.keeps(part.kept[0] + 1, part.kept[1] + 1));
  CHECK_FALSE(later.keeps(part.kept[0] - 1, part.kept[1] + 1));
  CHECK_FALSE(later.keeps(part.kept[0] + 1, part.kept[3] + 1));
}

TEST_CASE("composition: a quarter of an image without an object is a quarter of the image") {
  const Tensor<float> x({8, 12, 3}, 1.f);
  const PastedPart part = quarter_of_object(x, kWhite, 1, {0.99f, 0, 0.999f, 0});
  CHECK(part.top == 4);
  CHECK(part.left == 6);
  CHECK(part.height == 4);
  CHECK(part.width == 6);
  CHECK(part.to_top == 0);
  CHECK(part.to_left == 6);
}

TEST_CASE("composition: sepia of grey is grey times the rows' sums, cut off at white") {
  const Tensor<float> y = distorted_by("sepia", Tensor<float>({1, 1, 3}, 0.4f));
  CHECK(y[0] == Approx(0.4 * 1.351).margin(0.002));
  CHECK(y[1] == Approx(0.4 * 1.203).margin(0.002));
  CHECK(y[2] == Approx(0.4 * 0.937).margin(0.002));
}
