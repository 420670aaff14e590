#include "marching.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

// Returns the largest coordinate at t in half sides of the inner cube, 1 to kMarchFarthest.
float scale_at(const kernels::MarchRay& ray, float t) {
  float s = 1;
  for (int a = 0; a < 3; ++a) {
    const float y = 4 * std::abs(ray.o[a] + t * ray.d[a] - 0.5f);
    if (!(y < kernels::kMarchFarthest)) return kernels::kMarchFarthest;  // also for NaN: the walk ends
    s = std::max(s, y);
  }
  return s;
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

RayWalk::RayWalk(const float o[3], const float d[3], float step, float jitter) {
  const CubeSpan span = intersect_unit_cube(o, d);
  ray_.near = span.near, ray_.far = span.far, ray_.step = step, ray_.jitter = jitter;
  for (int a = 0; a < 3; ++a) {
    ray_.o[a] = o[a];
    ray_.d[a] = d[a];
    // A ray parallel to the axis gets so many steps per unit that it never leaves along this axis first.
    ray_.steps[a] = 1 / ((d[a] == 0 ? 1e-20f : d[a]) * step);
  }
}

RayWalk RayWalk::contracted(const float o[3], const float d[3], float step, float jitter, float near) {
  RayWalk walk(o, d, step, jitter);
  walk.contracted_ = true;
  walk.ray_.near = near + jitter * step * scale_at(walk.ray_, near);
  return walk;
}

Index RayWalk::next(const OccupancyGrid& grid, Index max, float* t, float* x) {
  using namespace kernels;
  if (contracted_) return FIELDMARK_KERNEL(march_contracted)(march_grid(grid), ray_, max, t, x);
  const Index count = FIELDMARK_KERNEL(march)(march_grid(grid), ray_, max, t);
  for (Index i = 0; i < count; ++i)
    for (Index a = 0; a < 3; ++a) x[3 * i + a] = ray_.o[a] + t[i] * ray_.d[a];
  return count;
}

void RayWalk::skip_empty(const OccupancyGrid& grid, std::span<RayWalk> walks, std::span<const Index> which) {
  using namespace kernels;
  const MarchGrid cells = march_grid(grid);
  for (std::size_t begin = 0; begin < which.size(); begin += kMarchLanes) {
    const auto some = which.subspan(begin, std::min<std::size_t>(kMarchLanes, which.size() - begin));
    const auto ray = [&](std::size_t i) -> MarchRay& {
      return walks[static_cast<std::size_t>(some[i])].ray_;
    };
    MarchRays rays{};
    std::fill_n(rays.far, kMarchLanes, -1.f);
    std::fill_n(rays.k, kMarchLanes, kMarchMost);
    for (std::size_t i = 0; i < some.size(); ++i) {
      const MarchRay& r = ray(i);
      for (int a = 0; a < 3; ++a) rays.o[a][i] = r.o[a], rays.d[a][i] = r.d[a], rays.steps[a][i] = r.steps[a];
      rays.near[i] = r.near, rays.far[i] = r.far, rays.step[i] = r.step, rays.jitter[i] = r.jitter;
      rays.k[i] = r.k;
    }
    if (walks[static_cast<std::size_t>(some[0])].contracted_)
      FIELDMARK_KERNEL(march_contracted_to_blocks)(cells, rays);
    else
      FIELDMARK_KERNEL(march_to_blocks)(cells, rays);
    for (std::size_t i = 0; i < some.size(); ++i) ray(i).near = rays.near[i], ray(i).k = rays.k[i];
  }
}

}  // namespace fieldmark::nerf
