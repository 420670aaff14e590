#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/refined_cameras.h>
#include <fieldmark/tools/bench/captures_bench.h>

#include <cmath>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::bench;

namespace {
std::vector<nerf::Camera> cameras_of(const nerf::Dataset& data) {
  std::vector<nerf::Camera> cameras;
  for (const nerf::View& v : data.views) cameras.push_back(v.camera);
  return cameras;
}
}  // namespace

TEST_CASE("captures_bench: jitter turns and moves every camera by the given amounts, each its own way") {
  const nerf::Dataset before = nerf::make_scene({.size = 16, .views = 5});
  nerf::Dataset after = before;
  jitter_cameras(after, {.degrees = 2, .part = 0.05, .seed = 3}, {0, 0, 0});
  const nerf::CameraMotion motion = nerf::mean_motion(cameras_of(before), cameras_of(after));
  constexpr double kRadius = 4.0311;  // of the sphere of the built-in scene's cameras
  CHECK(std::abs(motion.degrees - 2) < 1e-6);
  CHECK(std::abs(motion.distance / (0.05 * kRadius) - 1) < 1e-3);
  CHECK(after.views[0].camera.pose != after.views[1].camera.pose);
  nerf::Dataset again = before;
  jitter_cameras(again, {.degrees = 2, .part = 0.05, .seed = 3}, {0, 0, 0});
  CHECK(again.views[4].camera.pose == after.views[4].camera.pose);
}

TEST_CASE("captures_bench: depth bounds give the distance to the scene") {
  nerf::Dataset data = nerf::make_scene({.size = 16, .views = 1});
  data.views[0].depth = nerf::DepthRange{2, 6};  // harmonic mean 3
  nerf::Dataset moved = data;
  jitter_cameras(moved, {.degrees = 0, .part = 0.1}, {0, 0, 0});
  const nerf::CameraMotion motion = nerf::mean_motion(cameras_of(data), cameras_of(moved));
  CHECK(std::abs(motion.distance - 0.3) < 1e-9);
}

TEST_CASE("captures_bench: the part brought back is of what jitter lost") {
  std::vector<CaptureRow> rows;
  for (const CaptureVariant& variant : capture_variants()) rows.push_back({.variant = variant, .psnr = 30});
  CHECK(std::isnan(recovered(rows, &CaptureRow::psnr)));
  for (CaptureRow& row : rows)
    if (row.variant.jittered) row.psnr = row.variant.refined ? 28 : 22;
  CHECK(lost(rows, &CaptureRow::psnr) == 8);
  CHECK(recovered(rows, &CaptureRow::psnr) == 0.75);
  rows.pop_back();
  CHECK_THROWS_WITH(recovered(rows, &CaptureRow::psnr), Contains("must have every variant"));
}
