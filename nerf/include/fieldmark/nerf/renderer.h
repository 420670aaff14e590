#pragma once
#include <fieldmark/nerf/field_sampler.h>
#include <fieldmark/nerf/radiance_field.h>

#include <array>
#include <functional>
#include <memory>

namespace fieldmark::nerf {

/// Which rays of an image are traced together, and in what order.
struct RayOrder {
  Index width = 16;     ///< of a tile, pixels, at least 1: its rays pass through the same cells
  Index height = 16;    ///< likewise
  bool morton = false;  ///< along a Z-shaped curve within the tile, not line by line
};

/// How exactly a Renderer works.
struct RenderOptions {
  /// Samples along a ray for each that training took, > 0. What a ray misses between its samples is most of a
  /// image's error (`fieldmark bench field` measures it). Without meaning for mlp, see points.
  float finer = 4.f / 3;
  float stop = 3e-3f;          ///< a ray ends where its transmittance falls below this
  float least_weight = 1e-3f;  ///< samples of less weight get no colour
  /// bf16 looks features up in a rounded table and multiplies rounded numbers: less memory, 62 dB from the
  /// image in float. Needs bf16_units().
  Precision precision = Precision::fp32;
  /// Of a ray of an mlp field; none: those it was trained with.
  std::optional<RayPoints> points{};
  RayOrder order{};  ///< changes no number of an image, only how fast it comes
  /// Rays along each side of a pixel, 1 to 8, at the centres of its parts; the pixel is the mean of them all;
  /// 0: RadianceFieldOptions::supersampling. A camera's pixel has its own area's mean too: what one ray
  /// through its centre misses of that is up to 0.3 dB against photographs (docs/results/quality.md), at a
  /// quarter of the time of 2.
  Index supersampling = 0;
};

/// An image of a field.
struct Rendering {
  Tensor<float> rgb;      ///< [height, width, 3] over the field's background, in [0, 1]
  Tensor<float> opacity;  ///< [height, width] in [0, 1]
};

/// A sample that a ray sees.
struct SeenSample {
  Index ray = 0;                    ///< of the batch
  float weight = 0;                 ///< part of the ray's colour
  std::array<float, 3> position{};  ///< unit cube
  std::array<float, 3> colour{};    ///< as composited
};

/// Renders views of one field; keeps its buffers from view to view. The field must outlive it and may change
/// between views; callers of trace() say so with refresh().
class Renderer {
 public:
  /// @param options  weights and transmittances are in [0, 1], not checked
  /// @throws ValueError for bf16 where the CPU has none, if a tile is empty or `finer` is not positive
  explicit Renderer(const RadianceField& field, const RenderOptions& options = {});
  ~Renderer();
  /// One ray through the centre of every pixel, or several, see RenderOptions::supersampling; samples in the
  /// middle of their intervals.
  Rendering render(const Camera& camera);
  /// Takes the field's present numbers for trace(). render() does so by itself.
  void refresh() { packed_.update(); }
  /// Replaces colours before they are composited: receives positions x [n, 3] in the unit cube, the unit
  /// directions d [n, 3] they are seen from, and colours rgb [n, 3]. Called from several threads at once. An
  /// empty function draws the field as it is.
  using Recolour = std::function<void(const float* x, const float* d, Index n, float* rgb)>;
  /// Used from the next image on.
  void set_recolour(Recolour recolour) { recolour_ = std::move(recolour); }
  static constexpr Index kLanes = 16;  ///< calls of trace() that may run at the same time
  /// Colour and opacity of given rays, background not added.
  /// @param rays  in cube coordinates   @param lane  0 to kLanes - 1: calls with different lanes may run at
  /// the same time
  /// @param out  [R, 4] written   @param position  [R, 3] written unless null: the mean position of what the
  /// ray sees, by weight, in the unit cube; 0 where it sees nothing
  void trace(const RayBatch& rays, Index lane, float* out, float* position = nullptr);
  /// The samples of given rays that weigh more than least_weight, ray after ray, near to far.
  /// @param rays, lane  as above   @param out  overwritten
  void trace_samples(const RayBatch& rays, Index lane, std::vector<SeenSample>& out);

 private:
  struct Lane;
  template <class F>
  void trace_blocks(const RayBatch& rays, Lane& lane, F use);
  void trace_block(const RayBatch& rays, Lane& lane);
  Rendering trace_centres(const Camera& camera);
  void list_pixels(const Camera& camera, Index tile, Lane& lane) const;
  static void accumulate(const Lane& lane, Index rays, float* out, float* position);
  const RadianceField& field_;
  RenderOptions options_;
  float step_;  // cube sides
  Recolour recolour_;
  PackedWeights<float> packed_;
  std::vector<std::unique_ptr<Lane>> lanes_;
};

}  // namespace fieldmark::nerf
