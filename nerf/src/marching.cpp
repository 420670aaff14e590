#include <fieldmark/nerf/marching.h>
#include <fieldmark/nerf/space.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/march.h"

namespace fieldmark::nerf {
namespace {

kernels::MarchGrid march_grid(const OccupancyGrid& grid) {
  const Index blocks = grid.resolution() / 4;
  return {.resolution = static_cast<std::int32_t>(grid.resolution()),
          .block_side = static_cast<std::int32_t>(blocks),
          .coarse_side = static_cast<std::int32_t>((blocks + 1) / 2),
          .clearance = grid.clearances().data(),
          .words = grid.block_halves().data()};
}

}  // namespace

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

RayWalk RayWalk::contracted(const float o[3], const float d[3], float step, float jitter, float near) {
  RayWalk walk(o, d, step, jitter);
  walk.contracted_ = true;
  walk.near_ = near + jitter * step * walk.scale_at(near);  // of the next sample
  return walk;
}

// Inner half sides from the centre, 1 to kFarthest: by how much samples are further apart.
float RayWalk::scale_at(float t) const {
  float s = 1;
  for (int a = 0; a < 3; ++a) {
    const float y = 4 * std::abs(o_[a] + t * d_[a] - 0.5f);
    if (!(y < kFarthest)) return kFarthest;  // also where it is NaN: the walk ends
    s = std::max(s, y);
  }
  return s;
}

Index RayWalk::next(const OccupancyGrid& grid, Index max, float* t, float* x) {
  if (contracted_) return next_contracted(grid, max, t, x);
  const Index count = next_straight(grid, max, t);
  for (Index i = 0; i < count; ++i)
    for (Index a = 0; a < 3; ++a) x[3 * i + a] = o_[a] + t[i] * d_[a];
  return count;
}

// How many samples surely stay in the empty blocks around this one: a step moves the image by at most `step`
// where space is not contracted, and by less than 4 steps elsewhere. With |dy| = s step for the largest
// coordinate and c = (2/s - 1/s^2) y, |dc| <= (2/s - 1/s^2) |dy| + s (2/s^2 - 2/s^3) |dy| = (4 - 3/s) step.
Index RayWalk::next_contracted(const OccupancyGrid& grid, Index max, float* t, float* x) {
  constexpr Index kMost = 1 << 16;  // a direction of zeros never leaves
  const auto cells = static_cast<float>(grid.resolution());
  const float block = 4 / cells;
  Index count = 0;
  while (count < max && k_ < kMost) {
    float s = scale_at(near_);
    if (!(s < kFarthest)) break;
    float p[3], c[3];
    for (int a = 0; a < 3; ++a) p[a] = o_[a] + near_ * d_[a];
    contract(p, c);
    Index cell[3];
    for (int a = 0; a < 3; ++a) cell[a] = static_cast<Index>(c[a] * cells);
    const Index clearance = grid.clearance(cell[0] / 4, cell[1] / 4, cell[2] / 4);
    Index steps = 1;
    if (clearance > 1) {
      const float clear = block * static_cast<float>(clearance - 1);
      steps = std::max<Index>(static_cast<Index>(clear / (s + 4 * clear < 1 ? step_ : 4 * step_)), 1);
    } else if (clearance == 0 && grid.occupied(grid.cell(cell[0], cell[1], cell[2]))) {
      t[count] = near_;
      std::copy_n(c, 3, x + 3 * count++);
    }
    for (; steps > 0; --steps, ++k_) near_ += step_ * (s = scale_at(near_));
  }
  return count;
}

void RayWalk::skip_empty(const OccupancyGrid& grid, std::span<RayWalk> walks, std::span<const Index> which) {
  using namespace kernels;
  const MarchGrid seen = march_grid(grid);
  const auto kernel = FIELDMARK_KERNEL(march_to_blocks);
  for (std::size_t begin = 0; begin < which.size(); begin += kMarchLanes) {
    MarchRays rays{};
    const std::size_t count = std::min<std::size_t>(kMarchLanes, which.size() - begin);
    for (std::size_t i = 0; i < kMarchLanes; ++i) {
      if (i >= count) {
        rays.far[i] = -1;
        continue;
      }
      const RayWalk& w = walks[static_cast<std::size_t>(which[begin + i])];
      if (w.contracted_) return;  // not straight
      for (int a = 0; a < 3; ++a)
        rays.o[a][i] = w.o_[a], rays.d[a][i] = w.d_[a], rays.steps[a][i] = w.steps_[a];
      rays.near[i] = w.near_, rays.far[i] = w.far_, rays.step[i] = w.step_, rays.jitter[i] = w.jitter_;
      rays.k[i] = static_cast<std::int32_t>(w.k_);
    }
    kernel(seen, rays);
    for (std::size_t i = 0; i < count; ++i) walks[static_cast<std::size_t>(which[begin + i])].k_ = rays.k[i];
  }
}

Index RayWalk::next_straight(const OccupancyGrid& grid, Index max, float* t) {
  using namespace kernels;
  MarchRay ray{.o = {o_[0], o_[1], o_[2]},
               .d = {d_[0], d_[1], d_[2]},
               .steps = {steps_[0], steps_[1], steps_[2]},
               .near = near_,
               .far = far_,
               .step = step_,
               .jitter = jitter_,
               .k = static_cast<std::int32_t>(k_)};
  const Index count = FIELDMARK_KERNEL(march)(march_grid(grid), ray, max, t);
  k_ = ray.k;
  return count;
}

}  // namespace fieldmark::nerf
