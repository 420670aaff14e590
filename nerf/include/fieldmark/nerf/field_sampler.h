#pragma once
#include <fieldmark/nerf/radiance_field.h>

#include <memory>

namespace fieldmark::nerf {

/// The visible samples of some rays, packed ray by ray, with the values computed to find them.
struct RaySamples {
  std::vector<Index> ray_begin;         ///< R + 1 offsets
  std::vector<float> position;          ///< [S, 3] cube coordinates
  std::vector<float> t;                 ///< [S] distance along the ray, cube sides
  std::vector<float> density_features;  ///< [S, density_width()] see Field
  std::vector<float> colour_features;   ///< [S, colour_width()]
  std::vector<float> sigma;             ///< [S] 1 / cube side
  std::vector<float> delta;  ///< [S] length of each sample's interval; empty: the step of the march
  std::vector<float> z;      ///< [S, N_z] see Field::geometry(); empty: not kept
  /// S, the number of samples.
  Index size() const { return static_cast<Index>(t.size()); }
};

/// Computes the weights w_i of the samples of each ray, see composite(). @param step  spacing of samples
/// without delta
/// @param weights [S] written
void sample_weights(const RaySamples& samples, float step, float* weights);

/// Number and extent of the samples of a FieldSampler.
struct FieldSamplingOptions {
  float finer = 1;     ///< samples per sample at the field's step, > 0; mlp fields ignore it
  float stop = 1e-4f;  ///< transmittance threshold below which a ray ends; 0 never ends one early
  RayPoints points{};  ///< along a ray of an mlp field
};

/// Finds the visible samples of a field's rays. A hash field is marched (RaySampler). An mlp field is sampled
/// by its coarse network (HierarchicalSampler) and evaluated in waves of 16 samples per ray, near to far,
/// until the rays are opaque; its RaySamples hold z and delta, but no features. Reuses its buffers; use one
/// object per thread.
class FieldSampler {
 public:
  FieldSampler();
  /// Takes over the buffers of another sampler.
  FieldSampler(FieldSampler&&) noexcept;
  ~FieldSampler();

  /// @param packed  current matrices of field.params, or null
  /// @param jitter  [R] in [0, 1), or empty: samples in the middle of their intervals
  /// @throws ValueError or ShapeError if an argument does not match
  void sample(const RadianceField& field, const RayBatch& rays, std::span<const float> jitter,
              const FieldSamplingOptions& options, RaySamples& out,
              const PackedWeights<float>* packed = nullptr);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace fieldmark::nerf
