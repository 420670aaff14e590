#pragma once
#include <fieldmark/engine/kernel.h>

#include <cstdint>

namespace fieldmark::kernels {

/// An occupancy grid as rays see it.
struct MarchGrid {
  std::int32_t resolution, block_side, coarse_side;  ///< cells, blocks and pairs of blocks per axis
  const std::uint8_t*
      clearance;               ///< [block_side^3] distance to the nearest block with an occupied cell, blocks
  const std::uint32_t* words;  ///< [coarse_side^3, 2^3 blocks, 2 halves] bits of a block's 4^3 cells
};

/// A ray o + t d and how far it has been walked: the next sample is at near + (k + jitter) step.
struct MarchRay {
  float o[3], d[3];
  float steps[3];  ///< steps per unit along each axis, signed
  float near, far, step, jitter;
  std::int32_t k;
};

constexpr int kMarchLanes = 16;  ///< rays of a MarchRays

/// Neighbouring rays side by side, see MarchRay; lanes that hold no ray have far = -1.
struct MarchRays {
  float o[3][kMarchLanes], d[3][kMarchLanes], steps[3][kMarchLanes];
  float near[kMarchLanes], far[kMarchLanes];
  float step[kMarchLanes], jitter[kMarchLanes];
  std::int32_t k[kMarchLanes];
};

/// Inner half sides from the centre at which a ray in a contracted space ends, see RayWalk.
constexpr float kMarchFarthest = 128;
/// Samples after which any ray in a contracted space ends: one without a direction never leaves.
constexpr std::int32_t kMarchMost = 1 << 16;

/// A ray o + t d in the linear coordinates of a contracted space, see Space: its next sample is at t = near.
struct ContractedRay {
  float o[3], d[3];
  float near, step;
  std::int32_t k;  ///< samples passed
};

/// Such rays side by side; lanes that hold no ray have k = kMarchMost.
struct ContractedRays {
  float o[3][kMarchLanes], d[3][kMarchLanes];
  float near[kMarchLanes], step[kMarchLanes];
  std::int32_t k[kMarchLanes];
};

// Moves each k to the first sample that lies in a block with an occupied cell, or behind the ray's end.
FIELDMARK_DECLARE_KERNEL(void, march_to_blocks, (const MarchGrid& grid, MarchRays& rays))

// Writes the next samples in occupied cells to t, at most `max`, and moves k past them. Returns their number.
FIELDMARK_DECLARE_KERNEL(std::int64_t, march,
                         (const MarchGrid& grid, MarchRay& ray, std::int64_t max, float* t))

// The same for rays in a contracted space: near and k.
FIELDMARK_DECLARE_KERNEL(void, march_contracted_to_blocks, (const MarchGrid& grid, ContractedRays& rays))

// The next samples in occupied cells: t and their contracted positions x [max, 3].
FIELDMARK_DECLARE_KERNEL(std::int64_t, march_contracted,
                         (const MarchGrid& grid, ContractedRay& ray, std::int64_t max, float* t, float* x))

}  // namespace fieldmark::kernels
