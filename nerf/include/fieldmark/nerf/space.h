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

/// The maps from the world to the unit cube in which a field lives.
enum class SpaceKind {
  cube,       ///< a cube of the world; nothing lies outside
  ndc,        ///< the view of cameras that look along -z, from a plane to infinity
  contracted  ///< all of the world: a cube in the middle, linear, and around it the rest, contracted
};
/// "cube", "ndc" or "contracted".
std::string name_of(SpaceKind kind);
/// @throws ValueError if name is none of them
SpaceKind parse_space_kind(std::string_view name);

/// The map from the world to the unit cube.
///
/// cube:        x = (p - corner) / side.
/// ndc:         x = (1/2 - a p_x / p_z, 1/2 - b p_y / p_z, 1 + near / p_z) for p_z <= -near: normalised
/// device
///              coordinates (Mildenhall et al. 2020, appendix C), scaled to the unit cube. Lines stay lines.
/// contracted:  with y = 2 (p - corner) / side - 1 and s = max |y_i|,  x = 1/2 + y / 4 if s <= 1, else
///              1/2 + (2 - 1/s) y / (4 s). Source: Barron et al. 2022 (mip-NeRF 360), eq. 10, with the
///              largest coordinate in place of the length, so that the image of the world fills the cube
///              (Tancik et al. 2023, Nerfstudio).
struct Space {
  SpaceKind kind = SpaceKind::cube;  ///< which of the maps
  /// cube: maps to the unit cube. contracted: maps to [1/4, 3/4]^3. ndc: not used.
  Bounds bounds{};
  double near = 0;  ///< ndc: distance of the plane, length, > 0. contracted: beginning of rays, length, >= 0
  double slope_x = 1;  ///< ndc: a, half the cotangent of half the cube's horizontal angle, > 0
  double slope_y = 1;  ///< ndc: b, the same vertically, > 0

  /// The image of a point; outside the unit cube, or not finite, where the space does not hold it.
  Vec3 to_cube(const Vec3& p) const;
  /// The point with the image x. @param x  in the open unit cube
  Vec3 to_world(const Vec3& x) const;
  /// dL/dp of a point whose image has the gradient dL/dx = g: the transposed Jacobian of to_cube() times g.
  Vec3 gradient_in_world(const Vec3& p, const Vec3& g) const;
};

/// The rays of a field's samplers. cube and ndc: origin + t direction is in the unit cube. contracted: it is
/// in the linear coordinates 1/2 + y / 4, whose part outside [1/4, 3/4]^3 contract() brings in.
struct RayBatch {
  std::span<const float> origins;     ///< [R, 3]; must outlive the batch
  std::span<const float> directions;  ///< [R, 3] unit; must outlive the batch
  std::span<const float> seen_from;   ///< [R, 3] unit directions in the world; must outlive the batch
  bool contracted = false;            ///< see above
  float near = 0;                     ///< beginning of contracted rays, cube sides
  /// R, the number of rays.
  Index size() const { return static_cast<Index>(origins.size()) / 3; }
  /// Rays [begin, begin + n) of these.
  RayBatch part(Index begin, Index n) const;
};

/// Storage for the rays of some pixels of cameras.
struct CubeRays {
  std::vector<float> origins;     ///< [R, 3], see RayBatch
  std::vector<float> directions;  ///< [R, 3] unit
  std::vector<float> seen_from;   ///< [R, 3] unit, in the world
  /// Sets the number of rays.
  void resize(Index n);
  /// Sets the rays from `first` on, through pixels of a camera. @param pixels  [n, 2] x and y, see
  /// pixel_ray()
  void set(const Space& space, Index first, const Camera& camera, std::span<const float> pixels);
  /// All of them; valid until the next resize().
  RayBatch batch(const Space& space) const;
};

/// The contraction on linear cube coordinates, see Space. @param p, x  [3], may be the same
void contract(const float* p, float* x);

/// The cells of a grid over the cube that lie in at least one camera's image, in front of the camera: the
/// others cannot be trained. Tests each cell's centre and corners.
/// @param resolution  cells per axis, >= 1   @return [cells] x fastest, 1 where a camera sees the cell
std::vector<std::uint8_t> seen_cells(std::span<const Camera> cameras, const Space& space, Index resolution);

}  // namespace fieldmark::nerf
