#include "scene_space.h"

#include <fieldmark/nerf/camera_set.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "rotation.h"

namespace fieldmark::nerf {
namespace {

constexpr double kRayStart = 0.02;  // in median distances of the cameras
constexpr double kBefore = 0.95;    // relative to the nearest bound: the space in front is cut off
constexpr double kRim = 1.02;       // relative to the widest ray
constexpr double kOverhang = 0.05;  // of the bounds' side: margins of the cube that cameras see
constexpr double kLost = 1. / 16;   // of the bounds' side: eight cells of the occupancy grid
constexpr Index kPoints = 32;       // per axis, of a cube that is searched for the object

// Takes the plane from the data set's bounds, and slopes that cover the rays through every image's corners,
// at the plane and at infinity.
Space device_coordinates(const Dataset& data) {
  Space space{.kind = SpaceKind::ndc};
  double near = 0;
  for (const View& v : data.views)
    if (v.depth && (near == 0 || v.depth->near < near)) near = v.depth->near;
  space.near = near > 0 ? kBefore * near : 1;
  double across = 0, up = 0;
  for (const View& v : data.views)
    for (const double x : {0., static_cast<double>(v.camera.width)})
      for (const double y : {0., static_cast<double>(v.camera.height)}) {
        const Ray ray = pixel_ray(v.camera, x - 0.5, y - 0.5);
        const double t = (-space.near - ray.origin[2]) / ray.direction[2];
        for (const double where : {t, 1e6 * t}) {
          const double depth = -(ray.origin[2] + where * ray.direction[2]);
          across = std::max(across, std::abs(ray.origin[0] + where * ray.direction[0]) / depth);
          up = std::max(up, std::abs(ray.origin[1] + where * ray.direction[1]) / depth);
        }
      }
  space.slope_x = 0.5 / (kRim * across);
  space.slope_y = 0.5 / (kRim * up);
  return space;
}

bool contains(const Bounds& outer, const Bounds& inner) {
  for (std::size_t a = 0; a < 3; ++a)
    if (inner.corner[a] < outer.corner[a] - kOverhang * outer.side ||
        inner.corner[a] + inner.side > outer.corner[a] + (1 + kOverhang) * outer.side)
      return false;
  return true;
}

// Tells whether a point is in a view's image, and whether its pixel there is not transparent.
struct Sight {
  bool in_image = false, opaque = false;
};
Sight sight_of(const View& view, const Vec3& p) {
  const Camera& c = view.camera;
  const Vec3 v = p - c.position();
  const double depth = -dot(pose_column(c.pose, 2), v);
  if (!(depth > 0)) return {};
  const double x = std::floor(c.cx + c.fx * dot(pose_column(c.pose, 0), v) / depth),
               y = std::floor(c.cy - c.fy * dot(pose_column(c.pose, 1), v) / depth);
  if (!(x >= 0 && x < static_cast<double>(c.width) && y >= 0 && y < static_cast<double>(c.height))) return {};
  const Index pixel = static_cast<Index>(y) * c.width + static_cast<Index>(x);
  return {.in_image = true, .opaque = view.rgba[4 * pixel + 3] > 0};
}

// Returns true if `seen` has a point outside `bounds` that at least half of the views have in their image,
// all of these on the object.
bool reaches_out(std::span<const View> views, const Bounds& bounds, const Bounds& seen) {
  for (Index i = 0; i < kPoints * kPoints * kPoints; ++i) {
    Vec3 p{};
    for (std::size_t a = 0; Index n : {i % kPoints, i / kPoints % kPoints, i / (kPoints * kPoints)}) {
      p[a] = seen.corner[a] + (static_cast<double>(n) + 0.5) * seen.side / kPoints;
      ++a;
    }
    if (contains(bounds, {.corner = p, .side = 0})) continue;
    Index in_image = 0;
    const bool ruled_out = std::any_of(views.begin(), views.end(), [&](const View& view) {
      const Sight sight = sight_of(view, p);
      in_image += sight.in_image;
      return sight.in_image && !sight.opaque;
    });
    if (!ruled_out && 2 * in_image >= std::ssize(views)) return true;
  }
  return false;
}

// Returns `bounds`, or the cube that the cameras have in view if silhouettes show that the object extends
// beyond `bounds` or cameras show that it is tiny in them.
Bounds around_object(const Dataset& data, const Bounds& bounds) {
  if (!has_alpha(data)) return bounds;
  const CameraSpan span = camera_span(data);
  const double half = span.half_size;
  const Vec3& c = span.centre;
  const Bounds seen{.corner = {c[0] - half, c[1] - half, c[2] - half}, .side = 2 * half};
  if (contains(bounds, seen)) return seen.side < kLost * bounds.side ? seen : bounds;
  return reaches_out(data.views, bounds, seen) ? seen : bounds;
}

Space around(const Dataset& data) {
  CameraSpan span = camera_span(data);
  const auto middle = span.distances.begin() + static_cast<std::ptrdiff_t>(span.distances.size() / 2);
  std::nth_element(span.distances.begin(), middle, span.distances.end());
  const double reach = *middle;
  const Vec3& c = span.centre;
  return {.kind = SpaceKind::contracted,
          .bounds = {.corner = {c[0] - reach, c[1] - reach, c[2] - reach}, .side = 2 * reach},
          .near = kRayStart * *middle};
}

}  // namespace

bool has_alpha(const Dataset& data) {
  return std::any_of(data.views.begin(), data.views.end(), [](const View& v) {
    for (Index i = 3; i < v.rgba.size(); i += 4)
      if (v.rgba[i] < 1) return true;
    return false;
  });
}

Space scene_space(const Dataset& data, const Bounds& bounds) {
  if (data.scene == SceneType::forward) return device_coordinates(data);
  if (data.scene == SceneType::place) return around(data);
  return {.bounds = around_object(data, bounds)};
}

}  // namespace fieldmark::nerf
