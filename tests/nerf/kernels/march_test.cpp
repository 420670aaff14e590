#include "kernels/march.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "support/each_isa.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::kernels;

namespace {
constexpr int kSide = 12, kBlocks = 3, kCoarse = 2;  // odd number of blocks: the last pair is half empty

struct Grid {
  std::vector<bool> cells = std::vector<bool>(kSide * kSide * kSide);
  std::vector<std::uint8_t> clearance = std::vector<std::uint8_t>(kBlocks * kBlocks * kBlocks, 16);
  std::vector<std::uint32_t> words = std::vector<std::uint32_t>(kCoarse * kCoarse * kCoarse * 16);

  void fill(int x, int y, int z) {
    cells[static_cast<std::size_t>(x + kSide * (y + kSide * z))] = true;
    const int b[3] = {x / 4, y / 4, z / 4}, bit = x % 4 + 4 * (y % 4) + 16 * (z % 4);
    const int block = 8 * (b[0] / 2 + kCoarse * (b[1] / 2 + kCoarse * (b[2] / 2))) + b[0] % 2 +
                      2 * (b[1] % 2) + 4 * (b[2] % 2);
    words[static_cast<std::size_t>(2 * block + bit / 32)] |= 1u << (bit % 32);
    for (int k = 0; k < kBlocks * kBlocks * kBlocks; ++k) {
      const int away = std::max({std::abs(k % kBlocks - b[0]), std::abs(k / kBlocks % kBlocks - b[1]),
                                 std::abs(k / kBlocks / kBlocks - b[2])});
      auto& c = clearance[static_cast<std::size_t>(k)];
      c = static_cast<std::uint8_t>(std::min<int>(c, away));
    }
  }
  MarchGrid view() const { return {kSide, kBlocks, kCoarse, clearance.data(), words.data()}; }
};

MarchRay ray_through(const double* from, const double* to, float step, float jitter) {
  double d[3], norm = 0;
  for (int a = 0; a < 3; ++a) d[a] = to[a] - from[a], norm += d[a] * d[a];
  norm = std::sqrt(norm);
  MarchRay r{};
  r.far = static_cast<float>(norm);
  r.step = step;
  r.jitter = jitter;
  for (int a = 0; a < 3; ++a) {
    r.o[a] = static_cast<float>(from[a]);
    r.d[a] = static_cast<float>(d[a] / norm);
    r.steps[a] = 1 / (r.d[a] * step);
  }
  return r;
}

std::vector<float> walked(const Grid& grid, MarchRay ray, std::int64_t piece) {
  std::vector<float> all, t(static_cast<std::size_t>(piece) + 1, -7.f);
  for (std::int64_t count = piece; count == piece;) {
    count = FIELDMARK_KERNEL(march)(grid.view(), ray, piece, t.data());
    REQUIRE(t.back() == -7.f);  // writes nothing past the requested samples
    all.insert(all.end(), t.begin(), t.begin() + count);
  }
  return all;
}
}  // namespace

TEST_CASE("kernels/march: the samples of dense stepping in double, in pieces of any length") {
  each_isa([] {
    for (const double filled : {0.002, 0.05, 0.6}) {
      const auto u = uniform({kSide, kSide, kSide}, 0, 1, 1);
      Grid grid;
      for (int c = 0; c < kSide * kSide * kSide; ++c)
        if (u[c] < filled) grid.fill(c % kSide, c / kSide % kSide, c / kSide / kSide);
      const auto ends = uniform({100, 6}, 0, 1, 2);
      int samples = 0;
      for (int i = 0; i < 100; ++i) {
        const double* from = &ends.data[static_cast<std::size_t>(6 * i)];
        const MarchRay ray =
            ray_through(from, from + 3, i % 2 ? 0.004f : 0.07f, 0.01f * static_cast<float>(i));
        const auto got = walked(grid, ray, 1000);
        for (const std::int64_t piece : {1, 5, 16}) REQUIRE(walked(grid, ray, piece) == got);
        CAPTURE(filled, i);
        for (int k = 0;; ++k) {
          const float t = ray.near + (static_cast<float>(k) + ray.jitter) * ray.step;
          if (!(t < ray.far)) break;
          int cell[3];
          bool doubtful = false;  // within rounding error of a face
          for (int a = 0; a < 3; ++a) {
            const double p = kSide * (static_cast<double>(ray.o[a]) +
                                      static_cast<double>(t) * static_cast<double>(ray.d[a]));
            doubtful |= std::abs(p - std::round(p)) < 1e-4;
            cell[a] = static_cast<int>(p);
          }
          if (doubtful) continue;
          const auto c = static_cast<std::size_t>(cell[0] + kSide * (cell[1] + kSide * cell[2]));
          REQUIRE(std::binary_search(got.begin(), got.end(), t) == grid.cells[c]);
          samples += grid.cells[c];
        }
      }
      CHECK(samples > 0);
    }
  });
}

TEST_CASE("kernels/march: an empty grid is left at once, a full one in steps") {
  each_isa([] {
    Grid empty, full;
    for (int c = 0; c < kSide * kSide * kSide; ++c)
      full.fill(c % kSide, c / kSide % kSide, c / kSide / kSide);
    const double from[] = {0.1, 0.2, 0.3}, to[] = {0.9, 0.7, 0.8};
    const MarchRay ray = ray_through(from, to, 1.f / 64, 0.5f);
    CHECK(walked(empty, ray, 4).empty());
    CHECK(walked(full, ray, 4).size() == static_cast<std::size_t>(ray.far * 64 + 0.5f));
  });
}

TEST_CASE("kernels/march: rays side by side stop in the block of their first sample, or behind their end") {
  each_isa([] {
    Grid grid;
    grid.fill(6, 6, 6);
    grid.fill(1, 10, 2);
    const auto ends = uniform({kMarchLanes, 6}, 0, 1, 3);
    MarchRays rays{};
    std::vector<MarchRay> single;
    for (int i = 0; i < kMarchLanes; ++i) {
      const double* from = &ends.data[static_cast<std::size_t>(6 * i)];
      MarchRay r = ray_through(from, from + 3, 0.004f, 0.5f);
      if (i % 3 == 0) r.far = -1;  // a lane without a ray
      single.push_back(r);
      for (int a = 0; a < 3; ++a) rays.o[a][i] = r.o[a], rays.d[a][i] = r.d[a], rays.steps[a][i] = r.steps[a];
      rays.near[i] = r.near, rays.far[i] = r.far, rays.step[i] = r.step, rays.jitter[i] = r.jitter;
    }
    FIELDMARK_KERNEL(march_to_blocks)(grid.view(), rays);
    int jumped = 0, reached = 0;
    for (int i = 0; i < kMarchLanes; ++i) {
      MarchRay r = single[static_cast<std::size_t>(i)];
      CAPTURE(i);
      if (r.far < 0) {
        CHECK(rays.k[i] == 0);
        continue;
      }
      const auto want = walked(grid, r, 1000);
      const float t = r.near + (static_cast<float>(rays.k[i]) + r.jitter) * r.step;
      r.k = rays.k[i];
      CHECK(walked(grid, r, 1000) == want);
      if (t < r.far) {
        std::size_t block = 0;
        for (int a = 2; a >= 0; --a)
          block = block * kBlocks + static_cast<std::size_t>((r.o[a] + t * r.d[a]) * kBlocks);
        CHECK(grid.clearance[block] == 0);
        ++reached;
      }
      jumped += rays.k[i] > 0;
    }
    CHECK(jumped > 0);
    CHECK(reached > 0);
  });
}

namespace {
// t and contract(o + t d), in double.
struct Placed {
  double scale, x[3];
};
Placed placed(const MarchRay& r, double t) {
  Placed p{1, {}};
  for (int a = 0; a < 3; ++a) {
    p.x[a] = static_cast<double>(r.o[a]) + t * static_cast<double>(r.d[a]) - 0.5;
    p.scale = std::max(p.scale, 4 * std::abs(p.x[a]));
  }
  for (double& x : p.x) x = 0.5 + x * (2 - 1 / p.scale) / p.scale;
  return p;
}

std::vector<MarchRay> contracted_rays() {
  const auto ends = uniform({kMarchLanes, 6}, 0, 1, 3);
  std::vector<MarchRay> rays;
  for (int i = 0; i < kMarchLanes; ++i) {
    const MarchRay r = ray_through(&ends.data[static_cast<std::size_t>(6 * i)],
                                   &ends.data[static_cast<std::size_t>(6 * i + 3)], 0.004f, 0);
    MarchRay c{};
    c.near = 0.002f;
    c.step = 0.004f;
    for (int a = 0; a < 3; ++a) c.o[a] = r.o[a], c.d[a] = r.d[a];
    rays.push_back(c);
  }
  return rays;
}

std::vector<float> walked_contracted(const Grid& grid, MarchRay ray, std::int64_t piece) {
  std::vector<float> all, t(static_cast<std::size_t>(piece) + 1, -7.f),
      x(static_cast<std::size_t>(3 * piece) + 1, -7.f);
  for (std::int64_t count = piece; count == piece;) {
    count = FIELDMARK_KERNEL(march_contracted)(grid.view(), ray, piece, t.data(), x.data());
    REQUIRE((t.back() == -7.f && x.back() == -7.f));
    for (std::int64_t s = 0; s < count; ++s) {
      const Placed want = placed(ray, static_cast<double>(t[static_cast<std::size_t>(s)]));
      for (int a = 0; a < 3; ++a)
        REQUIRE(std::abs(static_cast<double>(x[static_cast<std::size_t>(3 * s + a)]) - want.x[a]) < 2e-7);
    }
    all.insert(all.end(), t.begin(), t.begin() + count);
  }
  return all;
}
}  // namespace

TEST_CASE(
    "kernels/march: contracted rays give every sample in a full grid, in pieces of any length, x within "
    "2e-7") {
  each_isa([] {
    Grid full;
    for (int c = 0; c < kSide * kSide * kSide; ++c)
      full.fill(c % kSide, c / kSide % kSide, c / kSide / kSide);
    for (const MarchRay& ray : contracted_rays()) {
      const auto got = walked_contracted(full, ray, 4000);
      for (const std::int64_t piece : {1, 5, 16}) REQUIRE(walked_contracted(full, ray, piece) == got);
      double t = static_cast<double>(ray.near);
      std::size_t k = 0;
      for (; placed(ray, t).scale < static_cast<double>(kMarchFarthest); ++k) {
        REQUIRE(k < got.size());
        REQUIRE(std::abs(static_cast<double>(got[k]) / t - 1) < 2e-5);
        t += static_cast<double>(ray.step) * placed(ray, t).scale;
      }
      CHECK((k > 250 && k + 1 >= got.size()));  // the last may lie on either side of the end
    }
  });
}

TEST_CASE(
    "kernels/march: contracted rays side by side stop in the block of their first sample, or at their end") {
  each_isa([] {
    Grid grid;
    grid.fill(6, 6, 6);
    grid.fill(1, 10, 2);
    grid.fill(11, 5, 5);  // far outside
    const std::vector<MarchRay> single = contracted_rays();
    MarchRays rays{};
    for (int i = 0; i < kMarchLanes; ++i) {
      const MarchRay& r = single[static_cast<std::size_t>(i)];
      for (int a = 0; a < 3; ++a) rays.o[a][i] = r.o[a], rays.d[a][i] = r.d[a];
      rays.near[i] = r.near, rays.step[i] = r.step, rays.k[i] = i % 3 ? 0 : kMarchMost;  // or no ray
    }
    FIELDMARK_KERNEL(march_contracted_to_blocks)(grid.view(), rays);
    int jumped = 0, reached = 0, ended = 0;
    for (int i = 0; i < kMarchLanes; ++i) {
      MarchRay r = single[static_cast<std::size_t>(i)];
      CAPTURE(i);
      if (i % 3 == 0) {
        CHECK((rays.k[i] == kMarchMost && rays.near[i] == r.near));
        continue;
      }
      const auto want = walked_contracted(grid, r, 1000);
      jumped += rays.k[i] > 0;
      r.near = rays.near[i];
      r.k = rays.k[i];
      CHECK(walked_contracted(grid, r, 1000) == want);
      const Placed p = placed(r, static_cast<double>(r.near));
      std::size_t block = 0;
      for (int a = 2; a >= 0; --a) block = block * kBlocks + static_cast<std::size_t>(p.x[a] * kBlocks);
      if (p.scale < static_cast<double>(kMarchFarthest)) {
        CHECK(grid.clearance[block] == 0);
        ++reached;
      } else {
        CHECK(want.empty());
        ++ended;
      }
    }
    CHECK((jumped > 2 && reached > 2 && ended > 0));
  });
}
