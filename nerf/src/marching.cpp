#include <fieldmark/nerf/marching.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/march.h"

namespace fieldmark::nerf {
namespace {

static_assert(RayWalk::kFarthest == kernels::kMarchFarthest);

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

// Inner half sides from the centre, 1 to kFarthest.
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

void RayWalk::skip_empty(const OccupancyGrid& grid, std::span<RayWalk> walks, std::span<const Index> which) {
  for (std::size_t begin = 0; begin < which.size(); begin += kernels::kMarchLanes) {
    const auto some = which.subspan(begin, std::min<std::size_t>(kernels::kMarchLanes, which.size() - begin));
    if (walks[static_cast<std::size_t>(some[0])].contracted_)
      skip_contracted(grid, walks, some);
    else
      skip_straight(grid, walks, some);
  }
}

void RayWalk::skip_straight(const OccupancyGrid& grid, std::span<RayWalk> walks,
                            std::span<const Index> which) {
  kernels::MarchRays rays{};
  std::fill_n(rays.far, kernels::kMarchLanes, -1.f);
  for (std::size_t i = 0; i < which.size(); ++i) {
    const RayWalk& w = walks[static_cast<std::size_t>(which[i])];
    for (int a = 0; a < 3; ++a)
      rays.o[a][i] = w.o_[a], rays.d[a][i] = w.d_[a], rays.steps[a][i] = w.steps_[a];
    rays.near[i] = w.near_, rays.far[i] = w.far_, rays.step[i] = w.step_, rays.jitter[i] = w.jitter_;
    rays.k[i] = static_cast<std::int32_t>(w.k_);
  }
  using namespace kernels;
  FIELDMARK_KERNEL(march_to_blocks)(march_grid(grid), rays);
  for (std::size_t i = 0; i < which.size(); ++i) walks[static_cast<std::size_t>(which[i])].k_ = rays.k[i];
}

void RayWalk::skip_contracted(const OccupancyGrid& grid, std::span<RayWalk> walks,
                              std::span<const Index> which) {
  kernels::ContractedRays rays{};
  std::fill_n(rays.k, kernels::kMarchLanes, kernels::kMarchMost);
  for (std::size_t i = 0; i < which.size(); ++i) {
    const RayWalk& w = walks[static_cast<std::size_t>(which[i])];
    for (int a = 0; a < 3; ++a) rays.o[a][i] = w.o_[a], rays.d[a][i] = w.d_[a];
    rays.near[i] = w.near_, rays.step[i] = w.step_;
    rays.k[i] = static_cast<std::int32_t>(w.k_);
  }
  using namespace kernels;
  FIELDMARK_KERNEL(march_contracted_to_blocks)(march_grid(grid), rays);
  for (std::size_t i = 0; i < which.size(); ++i) {
    RayWalk& w = walks[static_cast<std::size_t>(which[i])];
    w.near_ = rays.near[i];
    w.k_ = rays.k[i];
  }
}

Index RayWalk::next_contracted(const OccupancyGrid& grid, Index max, float* t, float* x) {
  using namespace kernels;
  ContractedRay ray{.o = {o_[0], o_[1], o_[2]},
                    .d = {d_[0], d_[1], d_[2]},
                    .near = near_,
                    .step = step_,
                    .k = static_cast<std::int32_t>(k_)};
  const Index count = FIELDMARK_KERNEL(march_contracted)(march_grid(grid), ray, max, t, x);
  near_ = ray.near;
  k_ = ray.k;
  return count;
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
