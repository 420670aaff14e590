#pragma once
#include <fieldmark/engine/packed_weights.h>
#include <fieldmark/nerf/field.h>
#include <fieldmark/nerf/marching.h>
#include <fieldmark/nerf/space.h>

namespace fieldmark::nerf {

/// How rays are marched.
struct SamplingOptions {
  float step = 1.f / 512;  ///< spacing of samples along a ray, cube sides, > 0
  float stop = 1e-4f;      ///< a ray ends where its transmittance falls below this; 0 never stops early
};

/// The samples of some rays that light still reaches, packed ray after ray, with what was computed to find
/// them.
struct RaySamples {
  std::vector<Index> ray_begin;         ///< R + 1 offsets
  std::vector<float> position;          ///< [S, 3] cube coordinates
  std::vector<float> t;                 ///< [S] distance along the ray, cube sides, see RayWalk
  std::vector<float> density_features;  ///< [S, density_width()] see Field
  std::vector<float> colour_features;   ///< [S, colour_width()]
  std::vector<float> sigma;             ///< [S] 1 / cube side
  std::vector<float> delta;  ///< [S] length each stands for; empty: the step they were marched with
  std::vector<float> z;      ///< [S, N_z] see Field::geometry(); empty: not kept
  /// S, the number of samples.
  Index size() const { return static_cast<Index>(t.size()); }
};

/// Marches rays through the occupied cells of a field and drops what lies behind opaque matter.
///
/// Works in waves of 4 to 16 samples a ray: march, look features up, evaluate the density, stop rays that are
/// opaque. In a scene of surfaces most samples lie behind one, and are never looked up. Reuses its buffers:
/// after the first calls nothing is allocated. One object per thread.
class RaySampler {
 public:
  /// @param packed  the matrices of params as they are now, or null: packed in every wave
  /// @param jitter  [R] offsets of the sample positions in [0, 1), or empty for 1/2 everywhere
  /// @throws ValueError if the step is not positive   @throws ShapeError if sizes do not fit
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
  std::vector<float> t_, x_, density_features_, colour_features_, sigma_;  // wave after wave
  Tape<float> tape_;
};

}  // namespace fieldmark::nerf
