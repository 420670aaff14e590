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

  /// Cells per axis.
  Index resolution() const { return resolution_; }
  /// Cells of the cube, resolution^3.
  Index cells() const { return resolution_ * resolution_ * resolution_; }
  /// Index of the cell at integer coordinates: x fastest.
  Index cell(Index x, Index y, Index z) const { return x + resolution_ * (y + resolution_ * z); }
  /// Whether a cell, see cell(), can hold matter.
  bool occupied(Index cell) const { return bits_[static_cast<std::size_t>(cell)] != 0; }
  /// The 4 x 4 x 4 block of cells at block coordinates as 64 bits, cell (x, y, z) of it at bit x + 4 y + 16
  /// z. Eight neighbouring blocks share a cache line.
  std::uint64_t block(Index bx, Index by, Index bz) const {
    const std::size_t at = block_place(bx, by, bz);
    return halves_[at] | std::uint64_t{halves_[at + 1]} << 32;
  }
  /// Distance to the nearest block with an occupied cell, in blocks along the axis that is furthest
  /// (Chebyshev), at most 16; 0 for such a block. All blocks nearer than that are empty, so a ray leaves
  /// them in one step; at a resolution of 128 the distances are 32 KiB, where the blocks are 256 KiB.
  Index clearance(Index bx, Index by, Index bz) const {
    return clearance_[static_cast<std::size_t>(bx + block_side_ * (by + block_side_ * bz))];
  }
  /// How many cells are occupied.
  Index occupied_cells() const;
  /// Blocks and clearances as rows of numbers, for the kernel that walks rays (kernels/march.h).
  std::span<const std::uint32_t> block_halves() const { return halves_; }
  /// [(resolution / 4)^3] what clearance() says of each block, x fastest.
  std::span<const std::uint8_t> clearances() const { return clearance_; }

  /// Rules out every cell for which `keep` (one entry a cell) is 0. @throws ShapeError if the sizes differ
  void restrict_to(std::span<const std::uint8_t> keep);

  /// Densities at n positions [n, 3] in the unit cube. Calls with one lane, from 0 to kLanes - 1, never
  /// overlap: a lane may own scratch.
  using Density = std::function<void(Index lane, const float* x, Index n, float* sigma)>;
  static constexpr Index kLanes = 32;  ///< calls of a Density that may run at the same time
  /// Looks at one random position in each of a fraction of the candidates, in turn, replaces their densities
  /// d by max(decay d, what it found), and marks occupied the cells whose density times `step` exceeds
  /// `threshold` (opacity of one sample, about). Depends only on the arguments and the state, not on the
  /// thread count, and allocates nothing.
  struct Update {
    float decay = 0.95f;      ///< of a candidate's density at each look, in [0, 1]
    float step = 1.f / 512;   ///< length of a sample, cube sides
    float threshold = 0.01f;  ///< optical depth of a sample
    Index fraction = 1;       ///< look at one of this many candidates
    std::uint64_t round = 0;  ///< number of this update: which candidates, and the random positions
  };
  /// See Update. @throws whatever density throws
  void update(const Density& density, const CounterRng& rng, const Update& update);

  /// The state, for files: densities [cells] (negative: not a candidate), from which `bits` follow with a
  /// threshold.
  std::span<const float> densities() const { return density_; }
  /// [cells] 1 where a cell is occupied.
  std::span<const std::uint8_t> bits() const { return bits_; }
  /// @throws ShapeError if a size is not cells()
  void restore(std::span<const float> densities, std::span<const std::uint8_t> bits);
  /// Sets which cells are occupied and forgets densities: how a stored field is read. @throws ShapeError
  /// likewise
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
