#include <fieldmark/core/error.h>
#include <fieldmark/nerf/camera.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
double dot_product(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec3 column(const Pose& p, std::size_t k) { return {p[k], p[4 + k], p[8 + k]}; }
void check_near(const Vec3& a, const Vec3& b, double tolerance) {
  for (std::size_t k = 0; k < 3; ++k) CHECK(std::abs(a[k] - b[k]) <= tolerance);
}
}  // namespace

TEST_CASE("camera: rays through corners and the middle, by hand") {
  // 90 degrees across 4 pixels: focal 2; the centre of pixel (0, 0) is 1.5 left of and 0.5 above the axis.
  const Camera c = make_camera({1, 0, 0, 7, 0, 1, 0, 8, 0, 0, 1, 9}, std::numbers::pi / 2, 4, 2);
  CHECK(std::abs(c.fx - 2) < 1e-14);
  const Ray r = pixel_ray(c, 0, 0);
  check_near(r.origin, {7, 8, 9}, 0);
  const double n = std::sqrt(0.75 * 0.75 + 0.25 * 0.25 + 1);
  check_near(r.direction, {-0.75 / n, 0.25 / n, -1 / n}, 1e-15);
  check_near(pixel_ray(c, 1.5, 0.5).direction, {0, 0, -1}, 1e-15);
  check_near(pixel_ray(c, 3.5, 0.5).direction, {std::sqrt(0.5), 0, -std::sqrt(0.5)}, 1e-15);
}

TEST_CASE("camera: look_at gives a rotation that looks at the target with up upwards") {
  for (const Vec3& eye : {Vec3{3, 1, 2}, Vec3{-4, 0.5, -1}, Vec3{0.2, 0.1, 9}, Vec3{0.2, 0.1, -9}}) {
    const Vec3 target{0.2, 0.1, 0.3};
    const Pose p = look_at(eye, target, {0, 0, 2});
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 3; ++b)
        CHECK(std::abs(dot_product(column(p, a), column(p, b)) - (a == b ? 1 : 0)) < 1e-14);
    const Vec3 x = column(p, 0), y = column(p, 1), z = column(p, 2);
    CHECK(dot_product({x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]}, z) ==
          Approx(1));
    const Camera c = make_camera(p, 0.7, 10, 10);
    const Vec3 to{target[0] - eye[0], target[1] - eye[1], target[2] - eye[2]};
    CHECK(std::abs(dot_product(c.forward(), to) - std::sqrt(dot_product(to, to))) < 1e-13);
    check_near(c.position(), eye, 0);
    CHECK(y[2] >= -1e-14);  // straight up or down, any direction of up will do
  }
}

TEST_CASE("camera: scaling keeps the view") {
  Camera c = make_camera(look_at({3, 1, 2}, {0, 0, 0}, {0, 0, 1}), 0.7, 400, 300);
  c.cx += 13, c.cy -= 7, c.fy *= 1.2;
  const Camera half = c.scaled(200);
  CHECK(half.width == 200);
  CHECK(half.height == 150);
  // The centre of pixel 10 at half size is the border between pixels 20 and 21.
  check_near(pixel_ray(half, 10, 20).direction, pixel_ray(c, 20.5, 40.5).direction, 1e-15);
  CHECK(c.scaled(0).width == 400);
  CHECK(c.scaled(100, 10).height == 10);
  CHECK(make_camera({}, 1, 1000, 1).scaled(10).height == 1);
}

TEST_CASE("camera: the float path agrees with the double one") {
  Camera c = make_camera(look_at({3, 1, 2}, {0, 0.5, 0}, {0, 0, 1}), 0.7, 400, 300);
  c.cx += 13.3;
  const std::vector<float> pixels{0, 0, 399, 299, 17.25f, 230.5f, -5, 500};
  std::vector<float> origins(12), directions(12);
  camera_rays(c, pixels, origins.data(), directions.data());
  for (std::size_t i = 0; i < 4; ++i) {
    const Ray r = pixel_ray(c, pixels[2 * i], pixels[2 * i + 1]);
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(origins[3 * i + k] == static_cast<float>(r.origin[k]));
      CHECK(std::abs(directions[3 * i + k] - r.direction[k]) < 2.4e-7);  // 4 ulp at 1/2
    }
  }
  camera_rays(c, {}, nullptr, nullptr);
}

TEST_CASE("camera: errors name argument and value") {
  const Camera c = make_camera({}, 1, 4, 3);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(c.scaled(0, 5), "[scaled] width and height must be at least 1, got 0 x 5");
  CHECK_THROWS_WITH(make_camera({}, 4, 2, 2),
                    Contains("[make_camera] angle_x must be in (0, pi) radians, got 4"));
  CHECK_THROWS_AS(make_camera({}, nan, 2, 2), ValueError);
  CHECK_THROWS_WITH(look_at({1, 2, 3}, {1, 2, 3}, {0, 0, 1}),
                    Contains("[look_at] eye and target must be finite and apart"));
  CHECK_THROWS_AS(look_at({nan, 2, 3}, {1, 2, 3}, {0, 0, 1}), ValueError);
  float out[3];
  CHECK_THROWS_WITH(camera_rays(c, std::vector<float>{1, 2, 3}, out, out), Contains("got 3 elements"));
}
