#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/nerf/camera.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "vec3.h"

namespace fieldmark::nerf {
namespace {
void check_size(const char* op, Index width, Index height) {
  if (width < 1 || height < 1)
    throw ValueError(std::string("[") + op + "] width and height must be at least 1, got " +
                     std::to_string(width) + " x " + std::to_string(height));
}
}  // namespace

Camera Camera::scaled(Index new_width, Index new_height) const {
  check_size("scaled", width, height);
  check_size("scaled", new_width, new_height);
  const double sx = static_cast<double>(new_width) / static_cast<double>(width);
  const double sy = static_cast<double>(new_height) / static_cast<double>(height);
  return {.pose = pose,
          .fx = fx * sx,
          .fy = fy * sy,
          .cx = cx * sx,
          .cy = cy * sy,
          .width = new_width,
          .height = new_height};
}

Camera Camera::scaled(Index size) const {
  if (size == 0) return *this;
  check_size("scaled", width, height);
  check_size("scaled", size, size);
  const Index longer = std::max(width, height);
  const auto side = [&](Index s) { return std::max<Index>(1, (2 * s * size + longer) / (2 * longer)); };
  return scaled(side(width), side(height));
}

std::array<double, 16> Camera::parameters() const {
  std::array<double, 16> p{};
  std::copy(pose.begin(), pose.end(), p.begin());
  p[12] = fx, p[13] = fy, p[14] = cx, p[15] = cy;
  return p;
}

Camera make_camera(const Pose& pose, double angle_x, Index width, Index height) {
  check_size("make_camera", width, height);
  if (!(angle_x > 0 && angle_x < std::numbers::pi))
    throw ValueError("[make_camera] angle_x must be in (0, pi) radians, got " + number_text(angle_x));
  const double w = static_cast<double>(width), focal = 0.5 * w / std::tan(0.5 * angle_x);
  return {.pose = pose,
          .fx = focal,
          .fy = focal,
          .cx = 0.5 * w,
          .cy = 0.5 * static_cast<double>(height),
          .width = width,
          .height = height};
}

Pose look_at(const Vec3& eye, const Vec3& target, const Vec3& up) {
  const Vec3 back = eye - target;
  const double distance = norm(back);
  if (!(distance > 0) || !std::isfinite(distance) || !std::isfinite(norm(eye)) || !std::isfinite(norm(up)))
    throw ValueError("[look_at] eye and target must be finite and apart, and up finite, got a distance of " +
                     number_text(distance));
  const Vec3 z = (1 / distance) * back;
  Vec3 x = cross(up, z);
  if (!(norm(x) > 1e-9 * norm(up))) {
    Vec3 axis{};
    const auto smaller = [](double a, double b) { return std::abs(a) < std::abs(b); };
    axis[static_cast<std::size_t>(std::min_element(z.begin(), z.end(), smaller) - z.begin())] = 1;
    x = cross(axis, z);
  }
  x = normalised(x);
  const Vec3 y = cross(z, x);
  return {x[0], y[0], z[0], eye[0], x[1], y[1], z[1], eye[1], x[2], y[2], z[2], eye[2]};
}

Ray pixel_ray(const Camera& c, double x, double y) {
  const double u = (x + 0.5 - c.cx) / c.fx, v = -(y + 0.5 - c.cy) / c.fy;
  const Pose& m = c.pose;
  const Vec3 d{m[0] * u + m[1] * v - m[2], m[4] * u + m[5] * v - m[6], m[8] * u + m[9] * v - m[10]};
  return {c.position(), normalised(d)};
}

void camera_rays(const Camera& camera, std::span<const float> pixels, float* origins, float* directions) {
  if (pixels.size() % 2 != 0)
    throw ValueError("[camera_rays] pixels must hold x and y for each pixel, got " +
                     std::to_string(pixels.size()) + " elements");
  float m[12];
  for (std::size_t k = 0; k < 12; ++k) m[k] = static_cast<float>(camera.pose[k]);
  const auto sx = static_cast<float>(1 / camera.fx), sy = static_cast<float>(-1 / camera.fy);
  const auto ox = static_cast<float>(0.5 - camera.cx), oy = static_cast<float>(0.5 - camera.cy);
  for (std::size_t i = 0; i < pixels.size() / 2; ++i) {
    const float u = (pixels[2 * i] + ox) * sx, v = (pixels[2 * i + 1] + oy) * sy;
    const float d0 = m[0] * u + m[1] * v - m[2], d1 = m[4] * u + m[5] * v - m[6],
                d2 = m[8] * u + m[9] * v - m[10];
    const float scale = 1 / std::sqrt(d0 * d0 + d1 * d1 + d2 * d2);
    directions[3 * i] = d0 * scale;
    directions[3 * i + 1] = d1 * scale;
    directions[3 * i + 2] = d2 * scale;
    for (std::size_t k = 0; k < 3; ++k) origins[3 * i + k] = m[4 * k + 3];
  }
}

}  // namespace fieldmark::nerf
