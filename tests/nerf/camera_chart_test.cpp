#include <fieldmark/core/error.h>
#include <fieldmark/nerf/camera_chart.h>

#include <cmath>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
// Cameras at these positions, looking along -z of the world with y up, in alternating splits.
DataReport report_of(const std::vector<Vec3>& places) {
  DataReport report{.name = "scene"};
  report.up = {0, 1, 0}, report.centre = {0, 0, -4}, report.distances = {4, 4, 4};
  for (const Vec3& p : places)
    report.cameras.push_back(
        {.name = "c" + std::to_string(report.cameras.size()),
         .split = report.cameras.size() % 2 == 0 ? "train" : "test",
         .camera = make_camera({1, 0, 0, p[0], 0, 1, 0, p[1], 0, 0, 1, p[2]}, 0.7, 80, 60)});
  return report;
}

enum class Ink { blue, orange, red };

// The mean position of the pixels of one colour in a panel, as fractions of its side from the upper left
// corner.
struct Spot {
  double x = 0, y = 0, pixels = 0;
};
Spot spot_of(const Tensor<float>& chart, Ink ink, int panel) {
  Spot spot;
  for (Index y = 92; y < 668; ++y)
    for (Index x = 32 + 600 * panel; x < 608 + 600 * panel; ++x) {
      const float* p = &chart.data[at(3 * (y * chart.shape[1] + x))];
      const float r = p[0], g = p[1], b = p[2];
      const bool blue = b > r + 0.3f, red = r > g + 0.6f, orange = r > b + 0.6f && g > 0.4f && !red;
      if (!(ink == Ink::blue ? blue : ink == Ink::red ? red : orange)) continue;
      spot.x += static_cast<double>(x - 30 - 600 * panel) / 580, spot.y += static_cast<double>(y - 90) / 580;
      ++spot.pixels;
    }
  spot.x /= spot.pixels, spot.y /= spot.pixels;
  return spot;
}
}  // namespace

TEST_CASE("camera_chart: cameras lie where they stand, from above and from the right, at one scale") {
  // Two cameras to the left of the centre, higher and nearer than the one to the right.
  const auto chart = camera_chart(report_of({{-1, 1, 0}, {1, 0, 1}}));
  CHECK(chart.shape == Shape{700, 1240, 3});
  const Spot left = spot_of(chart, Ink::blue, 0), right = spot_of(chart, Ink::orange, 0);
  REQUIRE((left.pixels > 50 && right.pixels > 50));
  CHECK(left.x < right.x);
  CHECK(left.y < right.y);  // nearer to the scene, which lies ahead
  const Spot high = spot_of(chart, Ink::blue, 1), low = spot_of(chart, Ink::orange, 1);
  CHECK(high.y < low.y);
  CHECK(high.x > low.x);  // ahead is drawn to the right
  CHECK(low.y - high.y == Approx((right.x - left.x) / 2).epsilon(0.1));
  CHECK(spot_of(chart, Ink::red, 0).pixels == 0);
}

TEST_CASE("camera_chart: an outlying camera does not shrink the others, and is on the edge in red") {
  DataReport report = report_of({{-1, 0, 0}, {1, 0, 0}, {0, 0, 1}, {0, 0, 2}, {500, 0, -500}});
  const auto mixed = [&] { return camera_chart(report); };
  report.cameras.back().outlying = true;
  const auto chart = mixed();
  const Spot red = spot_of(chart, Ink::red, 0);
  REQUIRE(red.pixels > 50);
  CHECK(red.x > 0.8);
  report.cameras.pop_back();
  const Spot with = spot_of(chart, Ink::orange, 0), without = spot_of(mixed(), Ink::orange, 0);
  CHECK(with.x == Approx(without.x));
  CHECK(with.y == Approx(without.y));
}

TEST_CASE("camera_chart: one camera, cameras at one place, and cameras that look straight down") {
  const double nan = std::nan("");
  for (DataReport report :
       {report_of({{0, 0, 0}}), report_of({{3, 3, 3}, {3, 3, 3}}), report_of({{0, 1, 0}, {1, 1, 0}})}) {
    const auto finite = [&] {
      for (const float v : camera_chart(report).data)
        if (!(v >= 0 && v <= 1)) return false;
      return true;
    };
    CHECK(finite());
    report.up = {0, 0, 1};
    CHECK(finite());
    report.up = {0, 0, -1};
    report.cameras.front().camera.pose[3] = 1e300;
    CHECK(finite());
    report.cameras.front().camera.pose[3] = nan;
    CHECK(finite());
  }
  CHECK_THROWS_WITH(camera_chart({}), "[camera_chart] cameras must be at least one, got none");
}
