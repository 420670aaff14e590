#pragma once
#include <fieldmark/nerf/occupancy_grid.h>

#include "kernels/march.h"

namespace fieldmark::nerf {

/// The part of a ray o + t d, t >= 0, in the unit cube; empty (near >= far) if the ray misses it. A ray
/// parallel to a face is inside if it lies on or between the two faces.
struct CubeSpan {
  float near = 0;  ///< distance at which the ray enters; 0 if it starts inside
  float far = 0;   ///< distance at which it leaves
};
/// @param o, d  origin and direction; near and far are in units of |d|
CubeSpan intersect_unit_cube(const float o[3], const float d[3]);

/// A resumable walk along one ray that skips samples in empty cells.
///
/// Straight: samples at t_k = near + (k + jitter) step, k = 0, 1, ..., while the ray is in the cube.
/// Contracted (see Space): t_0 = near + jitter step s(near), t_{k+1} = t_k + step s(t_k), where s is the
/// largest coordinate in half sides of the inner cube, at least 1, until s reaches kMarchFarthest. Densities
/// are per t / s, which depends on the position, not on the ray.
class RayWalk {
 public:
  /// @param o, d    origin and unit direction, see RayBatch
  /// @param step    spacing of samples, cube sides, > 0   @param jitter  in [0, 1)
  RayWalk(const float o[3], const float d[3], float step, float jitter);
  /// Makes a walk in a contracted space. @param near  where it begins, cube sides
  static RayWalk contracted(const float o[3], const float d[3], float step, float jitter, float near);
  /// Writes the next samples, at most `max`: t and their positions x [max, 3] in the unit cube.
  /// @return their number; fewer than `max` only at the end of the ray
  Index next(const OccupancyGrid& grid, Index max, float* t, float* x);
  /// Moves walks past empty cells. Optional: next() gives the same samples without it, only slower, since
  /// here rays through the same cells skip together.
  /// @param which  indices of the walks to move, all straight or all contracted
  static void skip_empty(const OccupancyGrid& grid, std::span<RayWalk> walks, std::span<const Index> which);

 private:
  kernels::MarchRay ray_{};
  bool contracted_ = false;
};

}  // namespace fieldmark::nerf
