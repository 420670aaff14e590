#pragma once
#include <fieldmark/nerf/radiance_field.h>

#include <array>
#include <functional>
#include <memory>

namespace fieldmark::nerf {

/// Precision and cost of a Renderer.
struct RenderOptions {
  /// Samples along a ray per training sample, > 0. The gaps between samples cause most of an image's error
  /// (`fieldmark bench field` measures it). Fields of kind mlp use `points` instead.
  float finer = 4.f / 3;
  float stop = 3e-3f;          ///< transmittance threshold below which a ray ends
  float least_weight = 1e-3f;  ///< samples of less weight get no colour
  /// bf16 reads features from a rounded table and multiplies rounded matrices: this takes less memory and has
  /// a PSNR of 62 dB against the fp32 image. Needs bf16_units().
  Precision precision = Precision::fp32;
  /// Samples along a ray of an mlp field; none: as in training.
  std::optional<RayPoints> points{};
  /// Rays along each side of a pixel, 1 to 8, through the centres of its equal parts; the pixel is their
  /// mean. 0: RadianceFieldOptions::supersampling. 2 gains up to 0.3 dB against ground truth at four times
  /// the cost.
  Index supersampling = 0;
};

/// An image of a field.
struct Rendering {
  Tensor<float> rgb;      ///< [height, width, 3] over the field's background, in [0, 1]
  Tensor<float> opacity;  ///< [height, width] in [0, 1]
};

/// A visible sample of a ray.
struct SeenSample {
  Index ray = 0;                    ///< of the batch
  float weight = 0;                 ///< share of the ray's colour
  std::array<float, 3> position{};  ///< unit cube
  std::array<float, 3> colour{};    ///< as composited
};

/// Renders views of one field and reuses its buffers between views. The field must outlive the renderer and
/// may change between views; callers of trace() must then call refresh().
class Renderer {
 public:
  /// @param options  weights and transmittances are in [0, 1], not checked
  /// @throws ValueError for bf16 where the CPU has none, or if finer or supersampling is out of range
  explicit Renderer(const RadianceField& field, const RenderOptions& options = {});
  ~Renderer();
  /// Renders a view with one ray through the centre of every pixel, or several, see
  /// RenderOptions::supersampling. Samples are in the middle of their intervals.
  /// @param offsets  displacement of each pixel, see View::offsets; null: none
  /// @throws ValueError unless there is one for each pixel
  Rendering render(const Camera& camera, const PixelOffsets* offsets = nullptr);
  /// Reads the current parameters of the field for trace(). render() does this itself.
  void refresh() { packed_.update(); }
  /// Replaces colours before they are composited. Receives positions x [n, 3] in the unit cube, unit viewing
  /// directions d [n, 3] and colours rgb [n, 3]. Several threads call it at once.
  using Recolour = std::function<void(const float* x, const float* d, Index n, float* rgb)>;
  /// Sets the function for the next images; an empty one leaves colours unchanged.
  void set_recolour(Recolour recolour) { recolour_ = std::move(recolour); }
  static constexpr Index kLanes = 16;  ///< calls of trace() that may run at the same time
  /// Computes colour and opacity of rays, background not added.
  /// @param rays  in cube coordinates   @param lane  0 to kLanes - 1; concurrent calls have different lanes
  /// @param out  [R, 4] written   @param position  [R, 3] written unless null: mean position of the samples
  /// by weight, in the unit cube; 0 for an empty ray
  void trace(const RayBatch& rays, Index lane, float* out, float* position = nullptr);
  /// Writes the samples of rays that weigh more than least_weight, ray by ray, near to far.
  /// @param rays, lane  as above   @param out  overwritten
  void trace_samples(const RayBatch& rays, Index lane, std::vector<SeenSample>& out);

 private:
  struct Lane;
  template <class F>
  void trace_blocks(const RayBatch& rays, Lane& lane, F use);
  void trace_block(const RayBatch& rays, Lane& lane);
  Rendering trace_pixels(const Camera& camera, const PixelOffsets* offsets);
  const RadianceField& field_;
  RenderOptions options_;
  float step_;  // cube sides
  Recolour recolour_;
  PackedWeights<float> packed_;
  std::vector<std::unique_ptr<Lane>> lanes_;
};

}  // namespace fieldmark::nerf
