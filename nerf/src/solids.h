#pragma once
#include <fieldmark/nerf/camera.h>

#include <cstdint>
#include <optional>

namespace fieldmark::nerf {

/// Shapes of a Solid.
enum class SolidKind { sphere, box, cylinder, cone, torus };

/// A solid of the analytic scenes. Cylinder, cone and torus have z as their axis.
struct Solid {
  SolidKind kind = SolidKind::sphere;  ///< its shape
  Vec3 centre{};                       ///< of its extent, in the world
  std::array<double, 2> turn{1, 0};    ///< cosine and sine of its rotation about z
  /// sphere: radius, -, -; box: half extents; cylinder: radius, half height, -; cone: radius of the base,
  /// half height, - (apex up); torus: radius of the ring, radius of the tube, -. All lengths > 0.
  Vec3 size{1, 1, 1};
};

/// The intersection of a ray and a solid's surface.
struct SolidHit {
  double t = 0;   ///< distance along the ray, > 0
  Vec3 normal{};  ///< unit, outwards, in the world
  Vec3 local{};   ///< the point in the solid's own frame: centre at 0, not turned
};

/// Returns the first point of the surface along the ray with t > 0, if any: in closed form, or for the torus
/// by sphere tracing to within 1e-7 of the surface (a ray that grazes it by less may be missed). Source: Hart
/// 1996 (Sphere tracing), for the torus.
std::optional<SolidHit> intersect(const Solid& solid, const Ray& ray);

/// Returns the radius of a sphere about the centre that holds the solid.
double bounding_radius(const Solid& solid);

/// Patterns, see texture_colour().
enum class TextureKind { flat, checker, stripes, rings, noise, marble };

/// Colour as a function of the position in a solid.
struct SolidTexture {
  TextureKind kind = TextureKind::flat;  ///< the pattern
  Vec3 a{0.7, 0.7, 0.7};                 ///< one of the two colours it varies between, in [0, 1]
  Vec3 b{0.3, 0.3, 0.3};                 ///< the other
  double scale = 0.2;                    ///< period of the pattern, length, > 0
  std::uint32_t seed = 0;                ///< of the noise
};

/// Returns the colour [3] at a point, on the segment between a and b.
///   flat     a
///   checker  a or b by the parity of cells of edge scale / 2
///   stripes  a or b by the angle about z, in 12 sectors, twisted by one turn in 8 scales of height
///   rings    a and b by the sine of the height plus 0.3 of the distance from the z axis
///   noise    a and b by four octaves of value noise, the coarsest with cells of edge scale
///   marble   stripes along x + z, bent by noise
Vec3 texture_colour(const SolidTexture& texture, const Vec3& point);

/// Returns smooth noise in [0, 1): trilinear between hashed lattice points, with the fade 3 t^2 - 2 t^3.
/// @param point  any; coordinates beyond 2^31 repeat
double value_noise(const Vec3& point, std::uint32_t seed);

}  // namespace fieldmark::nerf
