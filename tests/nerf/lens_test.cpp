#include "lens.h"
#include <fieldmark/core/error.h>

#include <cmath>

#include "support/catch.h"
#include "support/random.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
const Lens kFox{.k1 = 0.0578421, .k2 = -0.0805099, .p1 = -0.000980296, .p2 = 0.00015575};
const Camera kCamera{.fx = 40, .fy = 41, .cx = 19, .cy = 16, .width = 40, .height = 30};
}  // namespace

TEST_CASE("lens: distortion by the formula, one coefficient at a time") {
  const double x = 0.3, y = -0.2, r2 = 0.13;
  const auto expect = [&](const Lens& lens, double u, double v) {
    const Vec2 p = lens.distorted({x, y});
    CHECK(std::abs(p[0] - u) < 1e-15);
    CHECK(std::abs(p[1] - v) < 1e-15);
  };
  expect({}, x, y);
  expect({.k1 = 0.1}, x * (1 + 0.1 * r2), y * (1 + 0.1 * r2));
  expect({.k2 = 0.1}, x * (1 + 0.1 * r2 * r2), y * (1 + 0.1 * r2 * r2));
  expect({.p1 = 0.1}, x + 0.2 * x * y, y + 0.1 * (r2 + 2 * y * y));
  expect({.p2 = 0.1}, x + 0.1 * (r2 + 2 * x * x), y + 0.2 * x * y);
  CHECK(Lens{}.is_pinhole());
  CHECK(!kFox.is_pinhole());
}

TEST_CASE("lens: further coefficients by the formulas of their models") {
  const double x = 0.6, y = -0.8;  // r = 1
  const auto factor = [&](const Lens& lens) {
    const Vec2 p = lens.distorted({x, y});
    CHECK(std::abs(p[1] / y - p[0] / x) < 1e-14);
    return p[0] / x;
  };
  CHECK(factor({.k1 = 0.1, .k2 = 0.2, .k3 = 0.3, .k4 = 0.4}) == Approx(2.0));
  CHECK(Lens{.k4 = 0.5}.distorted({0.5, 0})[0] == Approx(0.5 * (1 + 0.5 * std::pow(0.5, 8))));
  const Lens rational{
      .k1 = 0.1, .k2 = 0.2, .k3 = 0.3, .k4 = 0.4, .k5 = 0.5, .k6 = 0.6, .model = LensModel::rational};
  CHECK(factor(rational) == Approx(1.6 / 2.5));
  // An equidistant fisheye images an angle t at distance t.
  const Lens equidistant{.model = LensModel::fisheye};
  CHECK(!equidistant.is_pinhole());
  for (const double t : {1e-5, 1e-4, 0.3, 1.2, 1.5})
    CHECK(std::abs(equidistant.distorted({std::tan(t), 0})[0] - t) < 1e-14);
  const Lens fisheye{.k1 = 0.1, .k2 = -0.02, .k3 = 0.003, .k4 = -0.0004, .model = LensModel::fisheye};
  const double t = 0.9, t2 = t * t;
  CHECK(fisheye.distorted({0, std::tan(t)})[1] ==
        Approx(t * (1 + t2 * (0.1 + t2 * (-0.02 + t2 * (0.003 - t2 * 0.0004))))).epsilon(1e-14));
  CHECK(fisheye.distorted({0, 0}) == Vec2{0, 0});
  CHECK(Lens{.model = LensModel::rational}.is_pinhole());
  CHECK(fisheye.text() == "fisheye k1 0.1 k2 -0.02 p1 0 p2 0 k3 0.003 k4 -0.0004");
}

TEST_CASE(
    "lens: each model is inverted to far less than 1e-6 pixels of an image 4000 pixels wide, or not at all") {
  const Lens lenses[] = {{.k1 = 0.05, .k2 = -0.03, .k3 = 0.02, .k4 = -0.001},
                         {.k1 = 0.3,
                          .k2 = 0.1,
                          .p1 = 0.001,
                          .p2 = -0.002,
                          .k3 = 0.02,
                          .k4 = 0.35,
                          .k5 = 0.15,
                          .k6 = 0.01,
                          .model = LensModel::rational},
                         {.model = LensModel::fisheye},
                         {.k1 = -0.03, .k2 = 0.01, .k3 = -0.004, .k4 = 0.0005, .model = LensModel::fisheye},
                         {.k1 = 0.06, .k2 = 0.02, .model = LensModel::fisheye}};
  for (const Lens& lens : lenses) {
    const bool fisheye = lens.model == LensModel::fisheye;
    const double reach = fisheye ? 4 : 1;  // 76 and 45 degrees from the axis
    for (int i = -20; i <= 20; ++i)
      for (int j = -20; j <= 20; ++j) {
        const Vec2 q{reach * i / 20, reach * j / 20};
        const auto back = lens.undistorted(lens.distorted(q));
        REQUIRE(back);
        const double focal = 4000 / (2 * reach);
        CHECK(std::hypot((*back)[0] - q[0], (*back)[1] - q[1]) * focal < 1e-7);
      }
  }
  // Beyond its pole, a rational lens forms no image.
  const Lens pole{.k4 = -1, .model = LensModel::rational};
  CHECK(!pole.is_regular({1.2, 0}));
  CHECK(pole.is_regular({0.5, 0}));
}

TEST_CASE("lens: a fisheye keeps all of the pinhole's image, or what it sees of it") {
  const Camera wide{
      .fx = 12, .fy = 12, .cx = 20, .cy = 15, .width = 40, .height = 30};  // corners at 119 degrees
  CHECK(covered_part(wide, {.model = LensModel::fisheye}) == Crop{0, 0, 40, 30});
  const Lens folding{.k1 = -0.5, .model = LensModel::fisheye};  // t - t^3 / 2 falls from t = 0.82 on
  const Crop part = covered_part(wide, folding);
  CHECK((part.width < 40 && part.height < 30 && part.width > 10));
  for (const Index x : {part.left, part.left + part.width - 1})
    for (const Index y : {part.top, part.top + part.height - 1})
      CHECK(folding.is_regular(
          {(static_cast<double>(x) + 0.5 - 20) / 12, (static_cast<double>(y) + 0.5 - 15) / 12}));
}

TEST_CASE("lens: undistorted inverts distorted") {
  for (const Lens& lens : {kFox, Lens{.k1 = -0.2, .k2 = 0.03}, Lens{.k1 = 0.3, .p1 = 0.01, .p2 = -0.02}})
    for (double x = -0.8; x <= 0.8; x += 0.1)
      for (double y = -0.8; y <= 0.8; y += 0.1) {
        const auto back = lens.undistorted(lens.distorted({x, y}));
        REQUIRE(back);
        CHECK(std::hypot((*back)[0] - x, (*back)[1] - y) < 1e-11);
      }
}

TEST_CASE("lens: where the image folds over there is no inverse") {
  // r (1 - r^2 / 3) rises to 2/3 at r = 1 and falls from there.
  const Lens lens{.k1 = -1.0 / 3};
  CHECK(lens.undistorted({0.66, 0}));
  CHECK(!lens.undistorted({0.67, 0}));
  CHECK(!lens.undistorted({-0.5, 0.5}));
  // (2, 0) reaches -2/3 on the second branch, r = 2, so it is not the inverse either.
  CHECK(!lens.is_regular({2, 0}));
  CHECK(!Lens{.k1 = std::nan("")}.undistorted({0.1, 0.1}));
}

TEST_CASE("lens: the covered part is a rectangle of sources that no larger one contains") {
  const auto source = [](const Lens& lens, Index column, Index row) {
    const auto x = static_cast<double>(column), y = static_cast<double>(row);
    const Vec2 p = lens.distorted({(x + 0.5 - 19) / 40, (y + 0.5 - 16) / 41});
    const double u = p[0] * 40 + 19, v = p[1] * 41 + 16;
    return u >= 0 && v >= 0 && u <= 40 && v <= 30;
  };
  CHECK(covered_part(kCamera, {}) == Crop{0, 0, 40, 30});
  // A barrel-distorted image covers all of the pinhole's image.
  CHECK(covered_part(kCamera, {.k1 = -0.1}) == Crop{0, 0, 40, 30});
  const Lens cushion{.k1 = 0.5, .p1 = 0.01};
  const Crop part = covered_part(kCamera, cushion);
  CHECK((part.left > 0 && part.top > 0 && part.width > 25 && part.height > 20));
  const auto all = [&](Index left, Index top, Index right, Index bottom) {
    for (Index y = top; y < bottom; ++y)
      for (Index x = left; x < right; ++x)
        if (x < 0 || y < 0 || !source(cushion, x, y)) return false;
    return true;
  };
  const Index right = part.left + part.width, bottom = part.top + part.height;
  CHECK(all(part.left, part.top, right, bottom));
  CHECK(!all(part.left - 1, part.top, right, bottom));
  CHECK(!all(part.left, part.top - 1, right, bottom));
  CHECK(!all(part.left, part.top, right + 1, bottom));
  CHECK(!all(part.left, part.top, right, bottom + 1));
}

TEST_CASE("lens: a camera of a part sees the same rays") {
  const Camera part = cropped(kCamera, {.left = 3, .top = 5, .width = 20, .height = 10});
  CHECK((part.width == 20 && part.height == 10));
  CHECK(pixel_ray(part, 4, 2).direction == pixel_ray(kCamera, 7, 7).direction);
  CHECK_THROWS_WITH(cropped(kCamera, {.left = 30, .top = 0, .width = 20, .height = 10}),
                    Contains("part must be within the image of 40 x 30, got 20 x 10 at (30, 0)"));
}

TEST_CASE("lens: an undistorted image has at each pixel what the lens put elsewhere") {
  // Linear interpolation is exact on an image that is linear in x and y.
  Tensor<float> rgba(Shape{30, 40, 4});
  for (Index y = 0; y < 30; ++y)
    for (Index x = 0; x < 40; ++x) {
      float* p = rgba.data.data() + 4 * (y * 40 + x);
      p[0] = static_cast<float>(x) / 40, p[1] = static_cast<float>(y) / 30, p[2] = 0.5f, p[3] = 1;
    }
  const Lens lens{.k1 = 0.2, .k2 = 0.05, .p1 = 0.003, .p2 = -0.002};
  const Crop part = covered_part(kCamera, lens);
  const Tensor<float> out = undistorted_image(rgba, kCamera, lens, part);
  REQUIRE(out.shape == Shape{part.height, part.width, 4});
  double worst = 0;
  for (Index y = 2; y < part.height - 2; ++y)
    for (Index x = 2; x < part.width - 2; ++x) {
      const double px = static_cast<double>(part.left + x) + 0.5,
                   py = static_cast<double>(part.top + y) + 0.5;
      const Vec2 p = lens.distorted({(px - 19) / 40, (py - 16) / 41});
      const float* got = out.data.data() + 4 * (y * part.width + x);
      raise_to(worst, std::abs(got[0] - (p[0] * 40 + 19 - 0.5) / 40));
      raise_to(worst, std::abs(got[1] - (p[1] * 41 + 16 - 0.5) / 30));
      CHECK(got[2] == Approx(0.5));
      CHECK(got[3] == 1);
    }
  CHECK(worst < 1e-6);
  const Tensor<float> same = undistorted_image(rgba, kCamera, {}, {0, 0, 40, 30});
  CHECK(same.data == rgba.data);
}

TEST_CASE("lens: the nearest pixels are where the lens puts the places that their offsets say") {
  const Camera seen{.fx = 40, .fy = 41, .cx = 19, .cy = 16, .width = 40, .height = 30};
  for (const Lens& lens : {Lens{.k1 = 0.2, .k2 = 0.05, .p1 = 0.003, .p2 = -0.002},
                           Lens{.k1 = 0.05, .model = LensModel::fisheye}}) {
    // Half the size of the part, as after a shrunken image.
    const Camera pinhole = cropped(kCamera, covered_part(kCamera, lens)).scaled(21, 17);
    const NearestPixels nearest = nearest_pixels(seen, lens, pinhole);
    REQUIRE(std::ssize(nearest.pixels) == 21 * 17);
    REQUIRE(std::ssize(*nearest.offsets) == 21 * 17);
    double off = 0, longest = 0;
    for (Index p = 0; p < 21 * 17; ++p) {
      const auto [dx, dy] = (*nearest.offsets)[at(p)];
      const Vec2 q = lens.distorted({(static_cast<double>(p % 21) + 0.5 + dx - pinhole.cx) / pinhole.fx,
                                     (static_cast<double>(p / 21) + 0.5 + dy - pinhole.cy) / pinhole.fy});
      const Index pixel = nearest.pixels[at(p)];
      raise_to(off, std::abs(q[0] * 40 + 19 - (static_cast<double>(pixel % 40) + 0.5)));
      raise_to(off, std::abs(q[1] * 41 + 16 - (static_cast<double>(pixel / 40) + 0.5)));
      raise_to(longest, std::hypot(dx * 40 / pinhole.fx, dy * 41 / pinhole.fy));
    }
    CHECK(off < 1e-4);
    CHECK(longest < 1);
    CHECK(longest > 0.3);
  }
}

TEST_CASE("lens: close to a fold a pixel has its true place or none") {
  // r - r^3 / 3 turns at r = 1; the pinhole sees up to r = 0.999.
  const Lens lens{.k1 = -1.0 / 3};
  const Camera seen{.fx = 200, .fy = 200, .cx = 0, .cy = 4, .width = 140, .height = 8};
  const Camera pinhole{.fx = 200, .fy = 200, .cx = 0, .cy = 4, .width = 200, .height = 8};
  const NearestPixels nearest = nearest_pixels(seen, lens, pinhole);
  Index none = 0;
  double off = 0;
  for (Index p = 0; p < 1600; ++p) {
    const Index pixel = nearest.pixels[at(p)];
    if (pixel < 0) {
      ++none;
      continue;
    }
    const Vec2 q{(static_cast<double>(p % 200) + 0.5 + (*nearest.offsets)[at(p)][0]) / 200,
                 (static_cast<double>(p / 200) - 3.5 + (*nearest.offsets)[at(p)][1]) / 200};
    CHECK(lens.is_regular(q));
    const Vec2 back = lens.distorted(q);
    raise_to(off, std::abs(200 * back[0] - (static_cast<double>(pixel % 140) + 0.5)));
    raise_to(off, std::abs(200 * back[1] + 4 - (static_cast<double>(pixel / 140) + 0.5)));
  }
  CHECK(off < 1e-4);
  CHECK(none > 0);
  CHECK(none < 400);
}

TEST_CASE("lens: without distortion the nearest pixels are those of the part, with offsets of 0") {
  const NearestPixels nearest =
      nearest_pixels(kCamera, {}, cropped(kCamera, {.left = 3, .top = 5, .width = 20, .height = 10}));
  for (Index p = 0; p < 200; ++p) {
    CHECK(nearest.pixels[at(p)] == (p / 20 + 5) * 40 + p % 20 + 3);
    for (const float step : (*nearest.offsets)[at(p)]) CHECK(std::abs(step) < 1e-12f);
  }
}

TEST_CASE("lens: the colour of what is transparent does not leak") {
  Tensor<float> rgba(Shape{30, 40, 4});
  for (Index i = 0; i < 1200; ++i)
    rgba[4 * i] = i % 40 < 20 ? 1.0f : 0.0f, rgba[4 * i + 1] = 1 - rgba[4 * i], rgba[4 * i + 3] = rgba[4 * i];
  const Tensor<float> out = undistorted_image(rgba, kCamera, {.k1 = -0.1}, {0, 0, 40, 30});
  for (Index i = 0; i < 1200; ++i) CHECK(out[4 * i + 1] == 0);
}

TEST_CASE("lens: errors name the coefficients and the place") {
  CHECK_THROWS_WITH(covered_part(kCamera, {.k1 = -2}),
                    Contains("must have an inverse everywhere in the image, got k1 -2 k2 0 p1 0 p2 0, which "
                             "has none at pixel (0, 0) of 40 x 30"));
  CHECK_THROWS_AS(covered_part(kCamera, {.k1 = -2}), ValueError);
  CHECK_THROWS_AS(undistorted_image(Tensor<float>(Shape{3, 4, 4}), kCamera, {}, {0, 0, 4, 3}), ShapeError);
}
