#include "camera_motion.h"

#include <cmath>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
nerf::Camera camera() {
  nerf::Camera c = nerf::make_camera(nerf::look_at({2.2, -3.1, 1.7}, {0.1, 0.2, 0}, {0, 0, 1}), 0.9, 60, 40);
  c.fy *= 1.1;
  c.cx += 3;
  c.cy -= 2;
  return c;
}
const nerf::Vec3 kPivot{0.1, 0.2, -0.1}, kPoint{-0.4, 0.5, 0.3};
}  // namespace

TEST_CASE("camera_motion: a point of a pixel's ray is seen there") {
  for (const double t : {0.5, 3.0}) {
    const nerf::Ray ray = nerf::pixel_ray(camera(), 12, 31);
    nerf::Vec3 p;
    for (std::size_t a = 0; a < 3; ++a) p[a] = ray.origin[a] + t * ray.direction[a];
    const Projection seen = project(camera(), p);
    CHECK(seen.x == Approx(12.5).epsilon(1e-12));
    CHECK(seen.y == Approx(31.5).epsilon(1e-12));
    CHECK(seen.depth > 0);
    CHECK(seen.depth < t);
  }
  CHECK(project(camera(), {5, -7, 4}).depth < 0);
}

TEST_CASE("camera_motion: no motion leaves a camera, and what each motion does") {
  const nerf::Camera c = camera();
  const nerf::Camera same = moved(c, kPivot, {});
  for (std::size_t i = 0; i < 12; ++i) CHECK(same.pose[i] == Approx(c.pose[i]).margin(1e-12));
  CHECK(same.fx == c.fx);
  CHECK(same.cy == c.cy);
  const Projection before = project(c, kPivot);
  // Rotations keep the pivot in place; a shift along the axis, positive towards the camera, brings it closer.
  const Projection turned = project(moved(c, kPivot, {0.1, -0.2, 0.3}), kPivot);
  CHECK(turned.x == Approx(before.x).epsilon(1e-12));
  CHECK(turned.y == Approx(before.y).epsilon(1e-12));
  CHECK(turned.depth == Approx(before.depth).epsilon(1e-12));
  CHECK(project(moved(c, kPivot, {0, 0, 0, 0, 0, 0.25}), kPivot).depth == Approx(0.75 * before.depth));
  const nerf::Camera cut = moved(c, kPivot, {0, 0, 0, 0, 0, 0, std::log(2.0), 0.1, -0.2});
  CHECK(cut.fx == Approx(2 * c.fx));
  CHECK(cut.fy == Approx(2 * c.fy));
  CHECK(cut.cx == Approx(c.cx + 6));
  CHECK(cut.cy == Approx(c.cy - 12));
}

TEST_CASE("camera_motion: the gradient is that of the moved camera's projection") {
  const auto gradient = motion_gradient(camera(), kPivot, kPoint);
  for (std::size_t k = 0; k < gradient[0].size(); ++k) {
    CameraMotion up{}, down{};
    up[k] = 1e-5;
    down[k] = -1e-5;
    const Projection a = project(moved(camera(), kPivot, up), kPoint),
                     b = project(moved(camera(), kPivot, down), kPoint);
    CAPTURE(k);
    CHECK(gradient[0][k] == Approx((a.x - b.x) / 2e-5).epsilon(1e-7).margin(1e-5));
    CHECK(gradient[1][k] == Approx((a.y - b.y) / 2e-5).epsilon(1e-7).margin(1e-5));
  }
}
