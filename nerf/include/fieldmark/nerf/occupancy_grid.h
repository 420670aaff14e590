#pragma once
#include <fieldmark/engine/aligned.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/engine/shape.h>

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace fieldmark::nerf {

/// Marks the cells of the unit cube that can hold matter; rays skip the others.
///
/// A cell is a candidate until restrict_to() rules it out; a candidate is occupied if its density was
/// recently above a threshold. The density is a decaying maximum (Mueller et al. 2022, appendix C), so that a
/// cell survives a few unlucky samples.
class OccupancyGrid {
 public:
  /// All cells are candidates and occupied. @param resolution  cells per axis, a multiple of 4 from 4 to 512
  explicit OccupancyGrid(Index resolution = 128);

  /// Cells per axis.
  Index resolution() const { return resolution_; }
  /// Cells of the cube, resolution^3.
  Index cells() const { return resolution_ * resolution_ * resolution_; }
  /// Index of the cell at integer coordinates: x fastest.
  Index cell(Index x, Index y, Index z) const { return x + resolution_ * (y + resolution_ * z); }
  /// True if a cell, see cell(), can hold matter.
  bool occupied(Index cell) const { return bits_[static_cast<std::size_t>(cell)] != 0; }
  /// Returns the 4 x 4 x 4 block of cells at block coordinates as 64 bits, its cell (x, y, z) at bit x + 4 y
  /// + 16 z. Eight neighbouring blocks share a cache line.
  std::uint64_t block(Index bx, Index by, Index bz) const {
    const std::size_t at = block_place(bx, by, bz);
    return halves_[at] | std::uint64_t{halves_[at + 1]} << 32;
  }
  /// Returns the Chebyshev distance to the nearest block with an occupied cell, in blocks, at most 16; 0 for
  /// such a block. All nearer blocks are empty, so a ray crosses them in one step. At a resolution of 128 the
  /// distances take 32 KiB, the blocks 256 KiB.
  Index clearance(Index bx, Index by, Index bz) const {
    return clearance_[static_cast<std::size_t>(bx + block_side_ * (by + block_side_ * bz))];
  }
  /// Counts the occupied cells.
  Index occupied_cells() const;
  /// The storage of block(), for the kernels that march rays.
  std::span<const std::uint32_t> block_halves() const { return halves_; }
  /// [(resolution / 4)^3] clearance() of each block, x fastest.
  std::span<const std::uint8_t> clearances() const { return clearance_; }

  /// Rules out cells whose `keep` [cells] is 0. @throws ShapeError if the sizes differ
  void restrict_to(std::span<const std::uint8_t> keep);

  /// Densities at n positions [n, 3] in the unit cube. Calls with the same lane, 0 to kLanes - 1, never
  /// overlap, so a lane may own scratch memory.
  using Density = std::function<void(Index lane, const float* x, Index n, float* sigma)>;
  static constexpr Index kLanes = 32;  ///< calls of a Density that may run at the same time
  /// Options of update().
  struct Update {
    float decay = 0.95f;      ///< of a candidate's density at each sample, in [0, 1]
    float step = 1.f / 512;   ///< length of a sample, cube sides
    float threshold = 0.01f;  ///< optical depth of a sample above which a cell is occupied
    Index fraction = 1;       ///< sample one of this many candidates
    std::uint64_t round = 0;  ///< number of this update: selects the candidates and the random positions
  };
  /// Samples the density s at one random position in each of a fraction of the candidates, taken in turn.
  /// Replaces their densities d by max(decay d, s) and marks the cells occupied where d step exceeds the
  /// threshold. Depends only on arguments and state, not on the thread count, and allocates nothing. @throws
  /// whatever density throws
  void update(const Density& density, const CounterRng& rng, const Update& update);

  /// State for files: densities [cells], negative for cells that are not candidates.
  std::span<const float> densities() const { return density_; }
  /// [cells] 1 where a cell is occupied.
  std::span<const std::uint8_t> bits() const { return bits_; }
  /// @throws ShapeError if a size is not cells()
  void restore(std::span<const float> densities, std::span<const std::uint8_t> bits);
  /// Sets the occupied cells of a stored field and discards densities. @throws ShapeError likewise
  void set_bits(std::span<const std::uint8_t> bits);

 private:
  void rebuild_blocks();
  void measure_clearance();
  Index resolution_, block_side_;
  std::vector<float> density_;
  std::vector<std::uint8_t> bits_;
  std::size_t block_place(Index bx, Index by, Index bz) const {
    const Index coarse = bx / 2 + coarse_side_ * (by / 2 + coarse_side_ * (bz / 2));
    return static_cast<std::size_t>(16 * coarse + 2 * (bx % 2 + 2 * (by % 2) + 4 * (bz % 2)));
  }
  Index coarse_side_;                    // pairs of blocks per axis
  AlignedVector<std::uint32_t> halves_;  // [coarse_side^3, 2 x 2 x 2 blocks, 2 halves]
  std::vector<std::uint8_t> clearance_;  // [block_side^3]
  std::vector<Index> candidates_;
};

}  // namespace fieldmark::nerf
