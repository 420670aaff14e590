#include <fieldmark/nerf/marching.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/march.h"

namespace fieldmark::nerf {

CubeSpan intersect_unit_cube(const float o[3], const float d[3]) {
  CubeSpan span{0, std::numeric_limits<float>::infinity()};
  for (int a = 0; a < 3; ++a) {
    if (d[a] == 0) {
      if (!(o[a] >= 0 && o[a] <= 1)) return {};
      continue;
    }
    const float t0 = (0 - o[a]) / d[a], t1 = (1 - o[a]) / d[a];
    span.near = std::max(span.near, std::min(t0, t1));
    span.far = std::min(span.far, std::max(t0, t1));
  }
  // Also false for NaN and for a direction of zeros, which never leaves.
  return span.near < span.far && std::isfinite(span.far) ? span : CubeSpan{};
}

RayWalk::RayWalk(const float o[3], const float d[3], float step, float jitter)
    : step_(step), jitter_(jitter) {
  const CubeSpan span = intersect_unit_cube(o, d);
  near_ = span.near;
  far_ = span.far;
  for (int a = 0; a < 3; ++a) {
    o_[a] = o[a];
    d_[a] = d[a];
    // Steps per unit along the axis; where the ray is parallel to it so many that the axis is never left
    // first.
    steps_[a] = 1 / ((d[a] == 0 ? 1e-20f : d[a]) * step);
  }
}

Index RayWalk::next(const OccupancyGrid& grid, Index max, float* t) {
  using namespace kernels;
  const Index blocks = grid.resolution() / 4;
  MarchRay ray{.o = {o_[0], o_[1], o_[2]},
               .d = {d_[0], d_[1], d_[2]},
               .steps = {steps_[0], steps_[1], steps_[2]},
               .near = near_,
               .far = far_,
               .step = step_,
               .jitter = jitter_,
               .k = static_cast<std::int32_t>(k_)};
  const Index count = FIELDMARK_KERNEL(march)({.resolution = static_cast<std::int32_t>(grid.resolution()),
                                               .block_side = static_cast<std::int32_t>(blocks),
                                               .coarse_side = static_cast<std::int32_t>((blocks + 1) / 2),
                                               .clearance = grid.clearances().data(),
                                               .words = grid.block_halves().data()},
                                              ray, max, t);
  k_ = ray.k;
  return count;
}

}  // namespace fieldmark::nerf
