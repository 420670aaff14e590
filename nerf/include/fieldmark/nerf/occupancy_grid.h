#pragma once
#include <fieldmark/engine/aligned.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/engine/shape.h>

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace fieldmark::nerf {

/// Which cells of the unit cube can hold matter: rays skip the others.
///
/// A cell is a candidate until something rules it out for good (the silhouettes, see visual_hull.h); of the
/// candidates, those are occupied whose density was recently above a threshold. Densities are tracked as a
/// decaying maximum (Mueller et al. 2022, appendix C), so that a cell survives a few unlucky samples.
class OccupancyGrid {
 public:
  /// @param resolution  cells per axis, a multiple of 4 from 4 to 512; at first every cell is a candidate and
  /// occupied
  explicit OccupancyGrid(Index resolution = 128);

  Index resolution() const { return resolution_; }
  Index cells() const { return resolution_ * resolution_ * resolution_; }
  /// Index of the cell at integer coordinates: x fastest.
  Index cell(Index x, Index y, Index z) const { return x + resolution_ * (y + resolution_ * z); }
  bool occupied(Index cell) const { return bits_[static_cast<std::size_t>(cell)] != 0; }
  /// The 4 x 4 x 4 block of cells at block coordinates as 64 bits, cell (x, y, z) of it at bit x + 4 y + 16
  /// z: one look-up tells a ray about the cell and about the block. Eight neighbouring blocks share a cache
  /// line.
  std::uint64_t block(Index bx, Index by, Index bz) const { return blocks_[block_place(bx, by, bz)]; }
  /// Whether any of the 8 x 8 x 8 cells around a cell is occupied, which a ray asks first: at a resolution of
  /// 128 the answers are 4 KiB, where the blocks are 256 KiB and fall out of a core's caches between rays.
  bool occupied_nearby(Index x, Index y, Index z) const {
    return coarse_[static_cast<std::size_t>(x / 8 + coarse_side_ * (y / 8 + coarse_side_ * (z / 8)))] != 0;
  }
  Index occupied_cells() const;

  /// Rules out every cell for which `keep` (one entry a cell) is 0. @throws ShapeError if the sizes differ
  void restrict_to(std::span<const std::uint8_t> keep);

  /// Densities at n positions [n, 3] in the unit cube.
  using Density = std::function<void(const float* x, Index n, float* sigma)>;
  /// Looks at one random position in each of a fraction of the candidates, in turn, replaces their densities
  /// d by max(decay d, what it found), and marks occupied the cells whose density times `step` exceeds
  /// `threshold` (opacity of one sample, about). Depends only on the arguments and the state, not on the
  /// thread count.
  struct Update {
    float decay = 0.95f;      ///< of a candidate's density at each look, in [0, 1]
    float step = 1.f / 512;   ///< length of a sample, cube sides
    float threshold = 0.01f;  ///< optical depth of a sample
    Index fraction = 1;       ///< look at one of this many candidates
    std::uint64_t round = 0;  ///< number of this update: which candidates, and the random positions
  };
  void update(const Density& density, const CounterRng& rng, const Update& update);

  /// The state, for files: densities [cells] (negative: not a candidate), from which `bits` follow with a
  /// threshold.
  std::span<const float> densities() const { return density_; }
  std::span<const std::uint8_t> bits() const { return bits_; }
  /// @throws ShapeError if a size is not cells()
  void restore(std::span<const float> densities, std::span<const std::uint8_t> bits);
  /// Sets which cells are occupied and forgets densities: how a stored field is read. @throws ShapeError
  /// likewise
  void set_bits(std::span<const std::uint8_t> bits);

 private:
  void rebuild_blocks();
  Index resolution_;
  std::vector<float> density_;
  std::vector<std::uint8_t> bits_;
  std::size_t block_place(Index bx, Index by, Index bz) const {
    const Index coarse = bx / 2 + coarse_side_ * (by / 2 + coarse_side_ * (bz / 2));
    return static_cast<std::size_t>(8 * coarse + bx % 2 + 2 * (by % 2) + 4 * (bz % 2));
  }
  Index coarse_side_;
  AlignedVector<std::uint64_t> blocks_;  // [coarse^3, 8]
  std::vector<std::uint8_t> coarse_;     // [coarse^3]
  std::vector<Index> candidates_;
};

}  // namespace fieldmark::nerf
