#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/nerf/occupancy_grid.h>

#include <algorithm>

#include "checks.h"

namespace fieldmark::nerf {
namespace {

constexpr Index kChunk = 1024;  // cells sampled together
constexpr float kExcluded = -1.f;
constexpr std::uint8_t kFarthest = 16;  // blocks

void check_cells(const char* name, std::size_t size, Index cells) {
  if (size != at(cells))
    throw ShapeError("[occupancy_grid] " + std::string(name) + " must have " + std::to_string(cells) +
                     " entries, got " + std::to_string(size));
}

}  // namespace

OccupancyGrid::OccupancyGrid(Index resolution) : resolution_(resolution), block_side_(resolution / 4) {
  if (resolution < 4 || resolution > 512 || resolution % 4 != 0)
    throw ValueError("[occupancy_grid] resolution must be a multiple of 4 from 4 to 512, got " +
                     std::to_string(resolution));
  density_.assign(at(cells()), 0.f);
  bits_.assign(at(cells()), 1);
  coarse_side_ = (block_side_ + 1) / 2;
  halves_.assign(at(16 * coarse_side_ * coarse_side_ * coarse_side_), 0);
  clearance_.assign(at(block_side_ * block_side_ * block_side_), 0);
  candidates_.resize(at(cells()));
  for (Index c = 0; c < cells(); ++c) candidates_[at(c)] = c;
  rebuild_blocks();
}

Index OccupancyGrid::occupied_cells() const {
  return static_cast<Index>(std::count_if(bits_.begin(), bits_.end(), [](std::uint8_t b) { return b != 0; }));
}

void OccupancyGrid::restrict_to(std::span<const std::uint8_t> keep) {
  check_cells("keep", keep.size(), cells());
  for (std::size_t c = 0; c < keep.size(); ++c)
    if (!keep[c]) {
      density_[c] = kExcluded;
      bits_[c] = 0;
    }
  std::erase_if(candidates_, [&](Index c) { return !keep[at(c)]; });
  rebuild_blocks();
}

void OccupancyGrid::update(const Density& density, const CounterRng& rng, const Update& u) {
  const Index n = static_cast<Index>(candidates_.size());
  const Index fraction = std::max<Index>(1, u.fraction), offset = static_cast<Index>(u.round) % fraction;
  const Index looked = n > offset ? (n - offset + fraction - 1) / fraction : 0;
  const float side = 1.f / static_cast<float>(resolution_);
  const auto look = [&](Index lane, Index begin, Index end) {
    float x[3 * kChunk], sigma[kChunk];
    for (Index i = begin; i < end; ++i) {
      const Index c = candidates_[at(offset + i * fraction)];
      const auto jitter = rng.uniform4(u.round, static_cast<std::uint64_t>(c));
      const Index xyz[3] = {c % resolution_, c / resolution_ % resolution_, c / (resolution_ * resolution_)};
      for (std::size_t a = 0; a < 3; ++a)
        x[at(3 * (i - begin)) + a] = (static_cast<float>(xyz[a]) + jitter[a]) * side;
    }
    density(lane, x, end - begin, sigma);
    for (Index i = begin; i < end; ++i) {
      const std::size_t c = at(candidates_[at(offset + i * fraction)]);
      density_[c] = std::max(u.decay * density_[c], sigma[i - begin]);
      bits_[c] = density_[c] * u.step > u.threshold;
    }
  };
  // Chunks are assigned to the lanes in turn, so each cell has one owner.
  parallel_for(kLanes, 1, [&](Index lane, Index) {
    for (Index begin = lane * kChunk; begin < looked; begin += kLanes * kChunk)
      look(lane, begin, std::min(begin + kChunk, looked));
  });
  rebuild_blocks();
}

void OccupancyGrid::restore(std::span<const float> densities, std::span<const std::uint8_t> bits) {
  check_cells("densities", densities.size(), cells());
  set_bits(bits);
  density_.assign(densities.begin(), densities.end());
  candidates_.clear();
  for (Index c = 0; c < cells(); ++c)
    if (density_[at(c)] >= 0) candidates_.push_back(c);
}

void OccupancyGrid::set_bits(std::span<const std::uint8_t> bits) {
  check_cells("bits", bits.size(), cells());
  bits_.assign(bits.begin(), bits.end());
  rebuild_blocks();
}

void OccupancyGrid::rebuild_blocks() {
  const Index n = block_side_;
  parallel_for(n, 1, [&](Index bz, Index) {
    for (Index by = 0; by < n; ++by)
      for (Index bx = 0; bx < n; ++bx) {
        std::uint64_t word = 0;
        for (Index i = 0; i < 64; ++i)
          if (bits_[at(cell(4 * bx + i % 4, 4 * by + i / 4 % 4, 4 * bz + i / 16))])
            word |= std::uint64_t{1} << i;
        halves_[block_place(bx, by, bz)] = static_cast<std::uint32_t>(word);
        halves_[block_place(bx, by, bz) + 1] = static_cast<std::uint32_t>(word >> 32);
        clearance_[at(bx + n * (by + n * bz))] = word ? 0 : kFarthest;
      }
  });
  measure_clearance();
}

// The distance is the largest of those along the axes, so the axes can be processed one after another:
//   d'(i) = min over j of max(d(j), |i - j|)
// A block farther away than the best so far cannot improve on it.
void OccupancyGrid::measure_clearance() {
  const Index n = block_side_;
  for (Index stride : {Index{1}, n, n * n})
    parallel_for(n * n, 64, [&](Index begin, Index end) {
      std::uint8_t line[128];
      for (Index k = begin; k < end; ++k) {
        std::uint8_t* d = &clearance_[at(k / stride * stride * n + k % stride)];
        for (Index i = 0; i < n; ++i) line[i] = d[i * stride];
        for (Index i = 0; i < n; ++i) {
          Index best = line[i];
          for (Index away = 1; away < best; ++away) {
            const Index below = i >= away ? line[i - away] : kFarthest;
            const Index above = i + away < n ? line[i + away] : kFarthest;
            best = std::min(best, std::max(std::min(below, above), away));
          }
          d[i * stride] = static_cast<std::uint8_t>(best);
        }
      }
    });
}

}  // namespace fieldmark::nerf
