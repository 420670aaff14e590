#pragma once
#include <fieldmark/nerf/camera.h>

#include <optional>

namespace fieldmark::nerf {

/// The forms that a Solid can have.
enum class SolidKind { sphere, box, cylinder, cone, torus };

/// A solid of the analytic scenes. Cylinder, cone and torus have z as axis.
struct Solid {
  SolidKind kind = SolidKind::sphere;  ///< its form
  Vec3 centre{};                       ///< of its extent, in the world
  std::array<double, 2> turn{1, 0};    ///< cosine and sine of its rotation about z
  /// sphere: radius, -, -; box: half extents; cylinder: radius, half height, -; cone: radius of the base,
  /// half height,
  /// - (apex up); torus: radius of the ring, radius of the tube, -. All lengths > 0.
  Vec3 size{1, 1, 1};
};

/// Where a ray meets a solid's surface.
struct SolidHit {
  double t = 0;   ///< distance along the ray, > 0
  Vec3 normal{};  ///< unit, outwards, in the world
  Vec3 local{};   ///< the point in the solid's own frame: centre at 0, not turned
};

/// The first point of the surface along the ray with t > 0, if any: closed forms, and for the torus sphere
/// tracing to within 1e-7 of the surface (a ray that grazes it by less may be missed). Source: Hart 1996
/// (Sphere tracing), for the torus.
std::optional<SolidHit> intersect(const Solid& solid, const Ray& ray);

/// Radius of a sphere about the solid's centre that holds all of it.
double bounding_radius(const Solid& solid);

}  // namespace fieldmark::nerf
