#pragma once
#include <fieldmark/nerf/camera.h>

#include <cstdint>

namespace fieldmark::nerf {

/// The patterns that texture_colour() lists.
enum class TextureKind { flat, checker, stripes, rings, noise, marble };

/// Colour as a function of the place in a solid: nothing to unwrap, the same from every side.
struct SolidTexture {
  TextureKind kind = TextureKind::flat;  ///< the pattern
  Vec3 a{0.7, 0.7, 0.7};                 ///< one of the two colours it varies between, in [0, 1]
  Vec3 b{0.3, 0.3, 0.3};                 ///< the other
  double scale = 0.2;                    ///< period of the pattern, length, > 0
  std::uint32_t seed = 0;                ///< of the noise
};

/// The colour [3] at a point; on the segment between a and b.
///   flat     a
///   checker  a or b by the parity of cells of edge scale / 2
///   stripes  a or b by the angle about z, in 12 sectors, twisted by one turn in 8 scales of height
///   rings    a and b by the sine of the height plus 0.3 of the distance from the z axis
///   noise    a and b by four octaves of value noise, the coarsest with cells of edge scale
///   marble   stripes along x + z, bent by noise
Vec3 texture_colour(const SolidTexture& texture, const Vec3& point);

/// Smooth noise in [0, 1): trilinear between hashed lattice points, with the fade 3 t^2 - 2 t^3.
/// @param point  any; coordinates beyond 2^31 repeat
double value_noise(const Vec3& point, std::uint32_t seed);

}  // namespace fieldmark::nerf
