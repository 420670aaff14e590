#pragma once
#include <fieldmark/nerf/occupancy_grid.h>

namespace fieldmark::nerf {

/// Where a ray o + t d passes through the unit cube, t >= 0; empty (near >= far) if it does not. A ray
/// parallel to a face counts as inside where it lies on or between the two faces; an origin inside gives near
/// = 0.
struct CubeSpan {
  float near = 0;  ///< distance at which the ray enters
  float far = 0;   ///< distance at which it leaves
};
/// @param o, d  origin and direction; near and far count in lengths of d
CubeSpan intersect_unit_cube(const float o[3], const float d[3]);

/// A walk along one ray, resumable, that leaves out the samples in empty cells.
///
/// Straight: samples at t_k = near + (k + jitter) step, k = 0, 1, ..., where the ray is in the cube.
/// Contracted (see Space): t_0 = near + jitter step s(near), t_{k+1} = t_k + step s(t_k), where s is the
/// largest coordinate in half sides of the inner cube, at least 1, until s reaches kFarthest. A field's
/// densities then count per t / s, which depends on the place and not on the ray, and samples are as far
/// apart in the cube as matters.
class RayWalk {
 public:
  static constexpr float kFarthest = 128;  ///< inner half sides from the centre: the cube's last 1/256
  /// @param o, d    origin and unit direction, as RayBatch has them
  /// @param step    distance of samples, cube sides, > 0   @param jitter  in [0, 1)
  RayWalk(const float o[3], const float d[3], float step, float jitter);
  /// A walk in a contracted space. @param near  where it begins, cube sides
  static RayWalk contracted(const float o[3], const float d[3], float step, float jitter, float near);
  /// Writes the next samples, at most `max`: t and their positions x [max, 3] in the unit cube.
  /// @return their number; fewer than `max` only at the end of the ray
  Index next(const OccupancyGrid& grid, Index max, float* t, float* x);
  /// Moves walks to where their next samples may be, past empty cells; next() then gives the same samples as
  /// without, sooner: rays that pass through the same cells jump together.
  /// @param which  numbers of the walks that are moved, in [0, walks.size()): all straight or all contracted
  static void skip_empty(const OccupancyGrid& grid, std::span<RayWalk> walks, std::span<const Index> which);

 private:
  static void skip_straight(const OccupancyGrid& grid, std::span<RayWalk> walks,
                            std::span<const Index> which);
  static void skip_contracted(const OccupancyGrid& grid, std::span<RayWalk> walks,
                              std::span<const Index> which);
  Index next_straight(const OccupancyGrid& grid, Index max, float* t);
  Index next_contracted(const OccupancyGrid& grid, Index max, float* t, float* x);
  float scale_at(float t) const;
  float o_[3], d_[3], steps_[3];
  float near_, far_, step_, jitter_;
  Index k_ = 0;
  bool contracted_ = false;
};

}  // namespace fieldmark::nerf
