#pragma once
#include <fieldmark/nerf/camera.h>

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::nerf {

/// A cube in world coordinates: positions x map to (x - corner) / side in [0, 1]^3.
struct Bounds {
  std::array<double, 3> corner{-1.5, -1.5, -1.5};  ///< the least x, y and z
  double side = 3;                                 ///< length of an edge, > 0
};

/// Maps from the world to the unit cube in which a field lives.
enum class SpaceKind {
  cube,       ///< a cube of the world; nothing lies outside
  ndc,        ///< the view of cameras that look along -z, from a plane to infinity
  contracted  ///< the whole world: linear in a cube in the middle, contracted outside it
};
/// Returns "cube", "ndc" or "contracted".
std::string name_of(SpaceKind kind);
/// @throws ValueError if name is none of them
SpaceKind parse_space_kind(std::string_view name);

/// The map from the world to the unit cube.
///
/// cube:        x = (p - corner) / side.
/// ndc:         x = (1/2 - a p_x / p_z, 1/2 - b p_y / p_z, 1 + near / p_z) for p_z <= -near: normalised
///              device coordinates (Mildenhall et al. 2020, appendix C), scaled to the unit cube. Lines
///              stay lines.
/// contracted:  with y = 2 (p - corner) / side - 1 and s = max |y_i|,  x = 1/2 + y / 4 if s <= 1, else
///              1/2 + (2 - 1/s) y / (4 s). Source: Barron et al. 2022 (mip-NeRF 360), eq. 10, with the
///              largest coordinate instead of the length, so that the image of the world fills the cube
///              (Tancik et al. 2023, Nerfstudio).
struct Space {
  SpaceKind kind = SpaceKind::cube;  ///< which of the maps
  /// cube: mapped to the unit cube. contracted: mapped to [1/4, 3/4]^3. ndc: not used.
  Bounds bounds{};
  double near = 0;     ///< ndc: distance of the plane, length, > 0. contracted: start of rays, length, >= 0
  double slope_x = 1;  ///< ndc: a, half the cotangent of half the cube's horizontal angle, > 0
  double slope_y = 1;  ///< ndc: b, the same vertically, > 0

  /// Maps a point to the cube; the result is outside the unit cube, or not finite, if the space does not
  /// contain the point.
  Vec3 to_cube(const Vec3& p) const;
  /// Maps a position in the cube back to the world. @param x  in the open unit cube
  Vec3 to_world(const Vec3& x) const;
  /// Returns dL/dp for the gradient dL/dx = g at x = to_cube(p): the transposed Jacobian of to_cube() times
  /// g.
  Vec3 gradient_in_world(const Vec3& p, const Vec3& g) const;
};

/// Rays for the samplers of a field. cube and ndc: origin + t direction is in the unit cube. contracted: it
/// is in linear coordinates 1/2 + y / 4, and contract() maps what is outside [1/4, 3/4]^3 into the cube.
struct RayBatch {
  std::span<const float> origins;     ///< [R, 3]; must outlive the batch
  std::span<const float> directions;  ///< [R, 3] unit; must outlive the batch
  std::span<const float> seen_from;   ///< [R, 3] unit directions in the world; must outlive the batch
  bool contracted = false;            ///< see above
  float near = 0;                     ///< start of contracted rays, cube sides
  /// R, the number of rays.
  Index size() const { return static_cast<Index>(origins.size()) / 3; }
  /// Returns rays [begin, begin + n).
  RayBatch part(Index begin, Index n) const;
};

/// Storage for rays through pixels of cameras.
struct CubeRays {
  std::vector<float> origins;     ///< [R, 3], see RayBatch
  std::vector<float> directions;  ///< [R, 3] unit
  std::vector<float> seen_from;   ///< [R, 3] unit, in the world
  /// Sets the number of rays.
  void resize(Index n);
  /// Sets the rays from `first` on to those through pixels of a camera. @param pixels  [n, 2] x and y, see
  /// pixel_ray()
  void set(const Space& space, Index first, const Camera& camera, std::span<const float> pixels);
  /// Returns all rays; valid until the next resize().
  RayBatch batch(const Space& space) const;
};

/// Contracts linear cube coordinates, see Space. @param p, x  [3], may be the same
void contract(const float* p, float* x);

/// Finds the cells of a grid over the cube that at least one camera has in front of it and in its image; the
/// others cannot be trained. Tests each cell's centre and corners.
/// @param resolution  cells per axis, >= 1   @return [cells] x fastest, 1 where a camera sees the cell
std::vector<std::uint8_t> seen_cells(std::span<const Camera> cameras, const Space& space, Index resolution);

}  // namespace fieldmark::nerf
