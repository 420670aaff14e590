#pragma once
#include <fieldmark/engine/kernel.h>

#include <cstdint>

namespace fieldmark::kernels {

/// An OccupancyGrid for the kernels that march rays.
struct MarchGrid {
  std::int32_t resolution, block_side, coarse_side;  ///< cells, blocks and pairs of blocks per axis
  const std::uint8_t* clearance;  ///< [block_side^3] blocks, see OccupancyGrid::clearance()
  const std::uint32_t* words;     ///< [coarse_side^3, 2^3 blocks, 2 halves] bits of a block's 4^3 cells
};

/// A ray o + t d and how far it has been marched. Straight rays: the next sample is at near + (k + jitter)
/// step. Contracted rays, in the linear coordinates of a contracted Space: the next sample, after k others,
/// is at near; steps, far and jitter are not used.
struct MarchRay {
  float o[3], d[3];
  float steps[3];  ///< steps per unit along each axis, signed
  float near, far, step, jitter;
  std::int32_t k;
};

constexpr int kMarchLanes = 16;  ///< rays in a MarchRays
/// Distance from the centre, in half sides of the inner cube, at which a contracted ray ends, see RayWalk.
constexpr float kMarchFarthest = 128;
/// Samples after which any contracted ray ends: a ray without a direction never leaves.
constexpr std::int32_t kMarchMost = 1 << 16;

/// Neighbouring rays side by side. A lane without a ray has far = -1 and k = kMarchMost.
struct MarchRays {
  float o[3][kMarchLanes], d[3][kMarchLanes], steps[3][kMarchLanes];
  float near[kMarchLanes], far[kMarchLanes], step[kMarchLanes], jitter[kMarchLanes];
  std::int32_t k[kMarchLanes];
};

// Moves each ray to its first sample in a block with an occupied cell, or past its end.
FIELDMARK_DECLARE_KERNEL(void, march_to_blocks, (const MarchGrid& grid, MarchRays& rays))
FIELDMARK_DECLARE_KERNEL(void, march_contracted_to_blocks, (const MarchGrid& grid, MarchRays& rays))

// Writes the next samples in occupied cells to t, at most `max`, and moves the ray past them. Returns their
// number.
FIELDMARK_DECLARE_KERNEL(std::int64_t, march,
                         (const MarchGrid& grid, MarchRay& ray, std::int64_t max, float* t))
// As march, and writes the contracted positions x [max, 3].
FIELDMARK_DECLARE_KERNEL(std::int64_t, march_contracted,
                         (const MarchGrid& grid, MarchRay& ray, std::int64_t max, float* t, float* x))

}  // namespace fieldmark::kernels
