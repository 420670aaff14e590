#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/nerf/occupancy_grid.h>

#include <algorithm>
#include <cmath>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
// Density 100 where x < 0.5, and 0 elsewhere.
void half(Index, const float* x, Index n, float* sigma) {
  for (Index i = 0; i < n; ++i) sigma[i] = x[3 * i] < 0.5f ? 100.f : 0.f;
}
void nothing(Index, const float*, Index n, float* sigma) { std::fill_n(sigma, n, 0.f); }

std::vector<std::uint8_t> ball(Index n) {
  std::vector<std::uint8_t> keep;
  for (Index c = 0; c < n * n * n; ++c) {
    const auto from = [&](Index i) { return (static_cast<double>(i) + 0.5) / static_cast<double>(n) - 0.5; };
    keep.push_back(std::hypot(from(c % n), from(c / n % n), from(c / (n * n))) < 0.3);
  }
  return keep;
}
}  // namespace

TEST_CASE("occupancy_grid: starts full, with x the fastest index") {
  const OccupancyGrid grid(8);
  CHECK(grid.cells() == 512);
  CHECK(grid.occupied_cells() == 512);
  CHECK(grid.cell(3, 2, 1) == 3 + 8 * 2 + 64);
  CHECK(grid.block(1, 1, 1) != 0);
}

TEST_CASE("occupancy_grid: an update keeps exactly the cells with matter") {
  OccupancyGrid grid(16);
  grid.update(half, CounterRng(1), {.step = 0.01f, .threshold = 0.01f});
  for (Index c = 0; c < grid.cells(); ++c) REQUIRE(grid.occupied(c) == (c % 16 < 8));
  CHECK(grid.block(1, 2, 3) != 0);
  CHECK(grid.block(2, 2, 3) == 0);
}

TEST_CASE("occupancy_grid: positions are inside their cells, and drawn anew each round") {
  OccupancyGrid grid(4);
  std::vector<float> first, second;
  const auto record = [](std::vector<float>& to) {
    return [&to](Index, const float* x, Index n, float* sigma) {
      to.assign(x, x + 3 * n);
      std::fill_n(sigma, n, 1.f);
    };
  };
  grid.update(record(first), CounterRng(3), {.threshold = -1, .round = 0});
  grid.update(record(second), CounterRng(3), {.threshold = -1, .round = 1});
  REQUIRE(first.size() == 192);
  CHECK(first != second);
  for (std::size_t c = 0; c < 64; ++c) {
    const std::size_t cell[] = {c % 4, c / 4 % 4, c / 16};
    for (std::size_t a = 0; a < 3; ++a)
      CHECK(std::floor(4 * first[3 * c + a]) == static_cast<float>(cell[a]));
  }
}

TEST_CASE("occupancy_grid: densities are a decaying maximum") {
  OccupancyGrid grid(4);
  grid.update(half, CounterRng(1), {.decay = 0.5f, .step = 0.01f, .threshold = 0.01f});
  CHECK(grid.densities()[0] == 100);
  // 100 -> 50 -> ... -> 1.5625 (depth 0.0156) -> 0.78 (below the threshold)
  for (int k = 0; k < 6; ++k)
    grid.update(nothing, CounterRng(1), {.decay = 0.5f, .step = 0.01f, .threshold = 0.01f});
  CHECK(grid.densities()[0] == 1.5625f);
  CHECK(grid.occupied_cells() == 32);
  grid.update(nothing, CounterRng(1), {.decay = 0.5f, .step = 0.01f, .threshold = 0.01f});
  CHECK(grid.occupied_cells() == 0);
  grid.update(half, CounterRng(1), {.decay = 0.5f, .step = 0.01f, .threshold = 0.01f});
  CHECK(grid.occupied_cells() == 32);  // an empty cell is still a candidate
}

TEST_CASE("occupancy_grid: a fraction looks at all candidates in as many rounds") {
  OccupancyGrid grid(8);
  grid.restrict_to(ball(8));
  const Index candidates = grid.occupied_cells();
  Index looked = 0;
  const auto count = [&](Index, const float*, Index n, float* sigma) {
    looked += n;
    std::fill_n(sigma, n, 7.f);
  };
  for (std::uint64_t round = 0; round < 3; ++round)
    grid.update(count, CounterRng(1), {.decay = 1, .threshold = -1, .fraction = 3, .round = round});
  CHECK(looked == candidates);
  CHECK(std::count(grid.densities().begin(), grid.densities().end(), 7.f) == candidates);
}

TEST_CASE("occupancy_grid: a cell that was ruled out stays out") {
  OccupancyGrid grid(8);
  const auto keep = ball(8);
  grid.restrict_to(keep);
  grid.update([](Index, const float*, Index n, float* s) { std::fill_n(s, n, 1e6f); }, CounterRng(1), {});
  CHECK(std::equal(keep.begin(), keep.end(), grid.bits().begin()));
}

TEST_CASE("occupancy_grid: a block holds the bits of its cells") {
  OccupancyGrid grid(12);
  grid.set_bits(ball(12));
  for (Index c = 0; c < grid.cells(); ++c) {
    const Index x = c % 12, y = c / 12 % 12, z = c / 144;
    const auto bit = (grid.block(x / 4, y / 4, z / 4) >> (x % 4 + 4 * (y % 4) + 16 * (z % 4))) & 1;
    REQUIRE((bit != 0) == grid.occupied(c));
  }
  CHECK(grid.occupied_cells() > 0);
  CHECK(grid.occupied_cells() < grid.cells());
}

TEST_CASE("occupancy_grid: clearance is the Chebyshev distance to the nearest block with an occupied cell") {
  const auto side = GENERATE(Index{8}, Index{20});
  OccupancyGrid grid(4 * side);
  std::vector<std::uint8_t> bits(static_cast<std::size_t>(grid.cells()));
  const Index places[3][3] = {{0, 1, 2}, {2, 0, 3}, {1, 3, 3}};  // blocks in one corner; the other is far
  for (const auto& p : places)
    bits[static_cast<std::size_t>(grid.cell(4 * p[0] + 1, 4 * p[1] + 3, 4 * p[2]))] = 1;
  grid.set_bits(bits);
  Index most = 0;
  for (Index z = 0; z < side; ++z)
    for (Index y = 0; y < side; ++y)
      for (Index x = 0; x < side; ++x) {
        Index nearest = 16;
        for (const auto& p : places)
          nearest = std::min(nearest, std::max({std::abs(x - p[0]), std::abs(y - p[1]), std::abs(z - p[2])}));
        REQUIRE(grid.clearance(x, y, z) == nearest);
        most = std::max(most, nearest);
      }
  CHECK(most == (side == 8 ? 6 : 16));
  grid.set_bits(std::vector<std::uint8_t>(bits.size()));
  CHECK(grid.clearance(0, 0, 0) == 16);
}

TEST_CASE("occupancy_grid: restore continues as the original would") {
  OccupancyGrid a(8), b(8);
  a.restrict_to(ball(8));
  a.update(half, CounterRng(1), {.step = 0.01f});
  b.restore(a.densities(), a.bits());
  const OccupancyGrid::Update next{.step = 0.01f, .fraction = 2, .round = 1};
  a.update(nothing, CounterRng(1), next);
  b.update(nothing, CounterRng(1), next);
  CHECK(std::equal(a.densities().begin(), a.densities().end(), b.densities().begin()));
  CHECK(std::equal(a.bits().begin(), a.bits().end(), b.bits().begin()));
}

TEST_CASE("occupancy_grid: errors name argument and value") {
  CHECK_THROWS_WITH(OccupancyGrid(6),
                    "[occupancy_grid] resolution must be a multiple of 4 from 4 to 512, got 6");
  CHECK_THROWS_AS(OccupancyGrid(516), ValueError);
  CHECK_THROWS_AS(OccupancyGrid(0), ValueError);
  OccupancyGrid grid(4);
  const std::vector<std::uint8_t> few(7);
  CHECK_THROWS_WITH(grid.restrict_to(few), "[occupancy_grid] keep must have 64 entries, got 7");
  CHECK_THROWS_WITH(grid.set_bits(few), "[occupancy_grid] bits must have 64 entries, got 7");
  CHECK_THROWS_WITH(grid.restore(std::vector<float>(3), few),
                    "[occupancy_grid] densities must have 64 entries, got 3");
}

TEST_CASE("occupancy_grid: the same bits for one and two threads") {
  std::vector<float> densities[2];
  for (int n = 1; n <= 2; ++n) {
    const ScopedThreads scope(n);
    OccupancyGrid grid(32);
    const auto smooth = [](Index, const float* x, Index count, float* sigma) {
      for (Index i = 0; i < count; ++i) sigma[i] = x[3 * i] * x[3 * i + 1] + x[3 * i + 2];
    };
    grid.update(smooth, CounterRng(5), {.fraction = 3, .round = 2});
    densities[n - 1].assign(grid.densities().begin(), grid.densities().end());
  }
  CHECK(densities[0] == densities[1]);
}
