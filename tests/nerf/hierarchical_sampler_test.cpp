#include "hierarchical_sampler.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
constexpr float kStep = 1.f / 256;

// Rays along x through the cube at various heights; the last one misses it.
struct RaysAlongX {
  std::vector<float> origins{-1, 0.5f, 0.5f, -1, 0.1f, 0.9f, 0.25f, 0.5f, 0.5f, -1, 1.5f, 0.5f},
      directions{1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0};
  RayBatch batch() const { return {origins, directions, directions}; }
};

RaySamples spread(HierarchicalSampler& sampler, const OccupancyGrid& grid, const RayPoints& points,
                  std::span<const float> jitter = {}) {
  const RaysAlongX rays;
  RaySamples out;
  sampler.spread(grid, rays.batch(), jitter, kStep, points, out);
  return out;
}

float sum(const std::vector<float>& v, Index begin, Index end) {
  return std::accumulate(v.begin() + begin, v.begin() + end, 0.f);
}

// Only cells with x in [0.25, 0.5) or [0.75, 1) are candidates.
OccupancyGrid two_slabs() {
  OccupancyGrid grid(16);
  std::vector<std::uint8_t> keep(static_cast<std::size_t>(grid.cells()));
  for (std::size_t c = 0; c < keep.size(); ++c) keep[c] = c % 16 / 4 == 1 || c % 16 / 4 == 3;
  grid.restrict_to(keep);
  return grid;
}
}  // namespace

TEST_CASE("hierarchical_sampler: average points lie in the middles of equal parts of the ray in the cube") {
  HierarchicalSampler sampler;
  const RaySamples s = spread(sampler, OccupancyGrid(16), {.average = 8});
  REQUIRE(s.ray_begin == std::vector<Index>{0, 8, 16, 24, 24});  // the last ray misses
  for (Index i = 0; i < 8; ++i) {
    const float middle = (static_cast<float>(i) + 0.5f) / 8;
    const auto k = static_cast<std::size_t>(i);
    CHECK(std::abs(s.t[k] - (1 + middle)) < 1e-6f);
    CHECK(std::abs(s.position[3 * k] - middle) < 1e-6f);
    CHECK(std::abs(s.delta[k] - 0.125f) < 1e-6f);
    CHECK(std::abs(s.t[16 + k] - 0.75f * middle) < 1e-6f);  // the ray starts inside
  }
}

TEST_CASE("hierarchical_sampler: jittered points stay in their parts, differ from ray to ray and repeat") {
  HierarchicalSampler sampler;
  const std::vector<float> jitter{0.1f, 0.7f, 0.3f, 0.2f};
  const RaySamples s = spread(sampler, OccupancyGrid(16), {.average = 16}, jitter);
  for (std::size_t i = 0; i < 32; ++i) {
    const float part = (s.t[i] - 1) * 16 - static_cast<float>(i % 16);
    CHECK((part >= -1e-4f && part < 1.0001f));
  }
  CHECK(s.t[0] != s.t[16]);
  const float first = (s.t[0] - 1) * 16, second = (s.t[1] - 1) * 16 - 1;
  CHECK(std::abs(first - second) > 1e-3f);
  CHECK(spread(sampler, OccupancyGrid(16), {.average = 16}, jitter).t == s.t);
}

TEST_CASE("hierarchical_sampler: deltas of a ray add up to its length, jittered or random") {
  HierarchicalSampler sampler;
  const std::vector<float> jitter{0.1f, 0.7f, 0.3f, 0.2f};
  for (const RayPoints points :
       {RayPoints{.average = 7}, {.average = 0, .random = 9}, {.average = 5, .random = 4}}) {
    const RaySamples s = spread(sampler, OccupancyGrid(16), points, jitter);
    REQUIRE(s.ray_begin[1] == points.first());
    for (std::size_t r = 0; r < 3; ++r) {
      CHECK(std::is_sorted(s.t.begin() + s.ray_begin[r], s.t.begin() + s.ray_begin[r + 1]));
      CHECK(std::abs(sum(s.delta, s.ray_begin[r], s.ray_begin[r + 1]) - (r == 2 ? 0.75f : 1)) < 1e-6f);
    }
  }
}

TEST_CASE("hierarchical_sampler: all points lie in occupied cells, and deltas measure those alone") {
  HierarchicalSampler sampler;
  const RaySamples s = spread(sampler, two_slabs(), {.average = 100});
  REQUIRE(s.ray_begin[1] == 100);
  for (std::size_t i = 0; i < 100; ++i) {
    const float x = s.position[3 * i];
    // The ends of occupied stretches are found to within half a step.
    CHECK(((x > 0.25f - kStep && x < 0.5f + kStep) || (x > 0.75f - kStep && x <= 1)));
  }
  CHECK(std::count_if(s.t.begin(), s.t.begin() + 100, [](float t) { return t < 1.6f; }) == 50);
  CHECK(std::abs(sum(s.delta, 0, 100) - 0.5f) < 2 * kStep);
}

TEST_CASE("hierarchical_sampler: importance points go where the weights are, among the first points") {
  HierarchicalSampler sampler;
  const RaysAlongX rays;
  const RaySamples first = spread(sampler, OccupancyGrid(16), {.average = 8, .importance = 24});
  std::vector<float> weights(first.t.size());
  weights[3] = 1;      // the first ray: its fourth interval
  weights[8 + 1] = 1;  // the second: half in each of two
  weights[8 + 6] = 1;
  RaySamples out;
  sampler.refine(rays.batch(), first, weights, out);
  REQUIRE(out.ray_begin == std::vector<Index>{0, 32, 64, 96, 96});
  const auto within = [&](std::size_t ray, float lo, float hi) {
    return std::count_if(out.t.begin() + out.ray_begin[ray], out.t.begin() + out.ray_begin[ray + 1],
                         [&](float t) { return t >= lo && t <= hi; });
  };
  CHECK(within(0, 1.375f, 1.5f) == 25);
  CHECK(within(1, 1.125f, 1.25f) == 13);
  CHECK(within(1, 1.75f, 1.875f) == 13);
  CHECK(within(2, 0.001f, 0.374f) == 16);  // no weight: uniform over the 0.75 of the ray
  for (std::size_t r = 0; r < 3; ++r) {
    CHECK(std::is_sorted(out.t.begin() + out.ray_begin[r], out.t.begin() + out.ray_begin[r + 1]));
    CHECK(std::abs(sum(out.delta, out.ray_begin[r], out.ray_begin[r + 1]) - (r == 2 ? 0.75f : 1)) < 1e-6f);
  }
  for (const float d : out.delta) CHECK(d >= 0);
}

TEST_CASE("hierarchical_sampler: random points without jitter depend on the ray alone") {
  HierarchicalSampler sampler;
  const RayPoints points{.average = 0, .random = 64};
  const RaySamples a = spread(sampler, OccupancyGrid(16), points),
                   b = spread(sampler, OccupancyGrid(16), points);
  CHECK(a.t == b.t);
  CHECK(a.t[0] != a.t[64]);
  const float mean = sum(a.t, 0, 64) / 64;
  CHECK(std::abs(mean - 1.5f) < 0.15f);  // four standard deviations of a mean of 64
}

TEST_CASE("hierarchical_sampler: errors name argument and what came") {
  HierarchicalSampler sampler;
  const OccupancyGrid grid(16);
  const RaysAlongX rays;
  RaySamples out;
  CHECK_THROWS_WITH(spread(sampler, grid, {.average = -1}),
                    "[hierarchical_sampler] average must be 0 to 1024, got -1");
  CHECK_THROWS_WITH(spread(sampler, grid, {.importance = 2000}),
                    "[hierarchical_sampler] importance must be 0 to 1024, got 2000");
  CHECK_THROWS_WITH(spread(sampler, grid, {.average = 0}), Contains("average or random must be at least 1"));
  CHECK_THROWS_WITH(spread(sampler, grid, {}, std::vector<float>(3)),
                    "[hierarchical_sampler] jitter must have one element a ray (4), got 3");
  CHECK_THROWS_WITH(sampler.spread(grid, rays.batch(), {}, 0, {}, out), Contains("step must be positive"));
  RayBatch bent = rays.batch();
  bent.contracted = true;
  CHECK_THROWS_WITH(sampler.spread(grid, bent, {}, kStep, {}, out), Contains("must be straight in the cube"));
  const RaySamples first = spread(sampler, grid, {.average = 4});
  CHECK_THROWS_WITH(sampler.refine(rays.batch(), first, std::vector<float>(3), out),
                    Contains("must be of the 12 samples of spread(), got 12 and 3"));
}
