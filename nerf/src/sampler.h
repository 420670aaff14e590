#pragma once
#include <fieldmark/nerf/field_sampler.h>

#include "marching.h"

namespace fieldmark::nerf {

/// @throws ShapeError "[op] ..." unless origins and directions are [R, 3] and jitter is empty or [R]
/// @throws ValueError unless step is positive
void check_rays(const char* op, const RayBatch& rays, std::span<const float> jitter, float step);

/// Spacing and end of marched rays.
struct SamplingOptions {
  float step = 1.f / 512;  ///< spacing of samples along a ray, cube sides, > 0
  float stop = 1e-4f;      ///< transmittance threshold below which a ray ends; 0 never ends one early
};

/// Marches rays through the occupied cells of a field and drops samples behind opaque matter.
///
/// Works in waves of 4 to 16 samples per ray: march, encode, evaluate the density, stop opaque rays. In a
/// scene of surfaces most samples lie behind one and are never encoded. Reuses its buffers, so it allocates
/// nothing after the first calls. Use one object per thread.
class RaySampler {
 public:
  /// @param packed  current matrices of params, or null: they are packed in every wave
  /// @param jitter  [R] offsets of the sample positions in [0, 1), or empty for 1/2 everywhere
  /// @throws ValueError if the step is not positive   @throws ShapeError if sizes do not match
  void sample(const Field<float>& field, const ParamStore<float>& params, const OccupancyGrid& grid,
              const RayBatch& rays, std::span<const float> jitter, const SamplingOptions& options,
              RaySamples& out, const PackedWeights<float>* packed = nullptr);

 private:
  struct Segment {
    Index ray, row, count;
  };
  void march_wave(const OccupancyGrid& grid);
  void evaluate(const Field<float>& field, const ParamStore<float>& params,
                const PackedWeights<float>* packed, Index first);
  void stop_rays(const SamplingOptions& options, std::size_t first_segment);
  void pack(Index rays, Index density, Index colour, RaySamples& out);

  std::vector<RayWalk> walks_;
  std::vector<float> transmittance_;
  std::vector<Index> alive_, place_;
  std::vector<Segment> segments_;
  std::vector<float> t_, x_, density_features_, colour_features_, sigma_;  // wave by wave
  Tape<float> tape_;
};

}  // namespace fieldmark::nerf
