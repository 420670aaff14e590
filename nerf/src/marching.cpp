#include <fieldmark/nerf/marching.h>

#include <algorithm>
#include <cmath>
#include <limits>

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

Index RayWalk::next(const OccupancyGrid& grid, Index max, float* t_out) {
  const auto n = static_cast<float>(grid.resolution());
  const float cell_side = 1 / n;
  const int last = static_cast<int>(grid.resolution()) - 1;
  Index count = 0;
  while (count < max) {
    const float t = near_ + (static_cast<float>(k_) + jitter_) * step_;
    if (!(t < far_)) break;
    int c[3];
    float p[3];
    for (int a = 0; a < 3; ++a) {
      p[a] = (o_[a] + t * d_[a]) * n;
      c[a] = std::clamp(static_cast<int>(p[a]), 0, last);
    }
    // Whole steps to where the cell ends, or the empty blocks around it: those samples share its answer.
    const auto clearance = static_cast<int>(grid.clearance(c[0] / 4, c[1] / 4, c[2] / 4));
    int low[3], high[3];
    for (int a = 0; a < 3; ++a) {
      low[a] = clearance ? 4 * (c[a] / 4 - clearance + 1) : c[a];
      high[a] = clearance ? 4 * (c[a] / 4 + clearance) : c[a] + 1;
    }
    float leave = std::numeric_limits<float>::infinity();
    for (int a = 0; a < 3; ++a)
      leave = std::min(leave,
                       (static_cast<float>(steps_[a] > 0 ? high[a] : low[a]) - p[a]) * cell_side * steps_[a]);
    const auto steps = std::max<Index>(1, static_cast<Index>(std::ceil(std::min(leave, 1e9f))));
    if (clearance ||
        !(grid.block(c[0] / 4, c[1] / 4, c[2] / 4) >> (c[0] % 4 + 4 * (c[1] % 4) + 16 * (c[2] % 4)) & 1)) {
      k_ += steps;
      continue;
    }
    for (const Index end = k_ + std::min(steps, max - count); k_ < end; ++k_) {
      const float in_cell = near_ + (static_cast<float>(k_) + jitter_) * step_;
      if (!(in_cell < far_)) return count;
      t_out[count++] = in_cell;
    }
  }
  return count;
}

}  // namespace fieldmark::nerf
