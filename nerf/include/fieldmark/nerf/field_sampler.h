#pragma once
#include <fieldmark/nerf/hierarchical_sampler.h>
#include <fieldmark/nerf/radiance_field.h>

namespace fieldmark::nerf {

/// Weights w_i of the samples of each ray, see composite(). @param step  spacing of samples that have no
/// delta
/// @param weights [S] written
void sample_weights(const RaySamples& samples, float step, float* weights);

/// Where and how exactly a FieldSampler looks.
struct FieldSamplingOptions {
  float finer = 1;     ///< samples along a ray for each at the field's step, > 0; without meaning for mlp
  float stop = 1e-4f;  ///< a ray ends where its transmittance falls below this; 0 never stops early
  RayPoints points{};  ///< of a ray of an mlp field
};

/// The samples of a field's rays that light still reaches, by what suits the field: RaySampler for one with a
/// table; for an mlp field the coarse network and HierarchicalSampler, then the fine network in waves of 16
/// samples a ray, near to far, until the rays are opaque. Of the latter RaySamples holds z and delta, but no
/// features. Reuses its buffers. One object per thread.
class FieldSampler {
 public:
  /// @param packed  the matrices of field.params as they are now, or null
  /// @param jitter  [R] in [0, 1), or empty: samples in the middles of their intervals
  /// @throws as RaySampler and HierarchicalSampler
  void sample(const RadianceField& field, const RayBatch& rays, std::span<const float> jitter,
              const FieldSamplingOptions& options, RaySamples& out,
              const PackedWeights<float>* packed = nullptr);

 private:
  void coarse_densities(const RadianceField& field, const Params<float>& params);
  void evaluate(const RadianceField& field, const Params<float>& params, float stop, RaySamples& out);
  void evaluate_wave(const RadianceField& field, const Params<float>& params, RaySamples& out);
  void keep_evaluated(Index width, RaySamples& out);

  RaySampler march_;
  HierarchicalSampler hierarchical_;
  RaySamples first_;
  std::vector<float> weights_, x_, features_, transmittance_;
  std::vector<Index> alive_, evaluated_, rows_;
  Tape<float> tape_;
};

}  // namespace fieldmark::nerf
