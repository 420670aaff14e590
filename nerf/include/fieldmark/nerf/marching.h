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

/// A walk along one ray, resumable: the samples are at t_k = near + (k + jitter) step, k = 0, 1, ..., those
/// in empty cells left out. @param o, d  origin and unit direction in cube coordinates   @param jitter  in
/// [0, 1)
class RayWalk {
 public:
  /// @param step  distance of samples, cube sides, > 0
  RayWalk(const float o[3], const float d[3], float step, float jitter);
  /// Writes the next samples, at most `max`. @return their number; fewer than `max` only at the end of the
  /// ray
  Index next(const OccupancyGrid& grid, Index max, float* t);

 private:
  float o_[3], d_[3], steps_[3];
  float near_, far_, step_, jitter_;
  Index k_ = 0;
};

}  // namespace fieldmark::nerf
