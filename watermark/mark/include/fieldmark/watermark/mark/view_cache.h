#pragma once
#include <fieldmark/nerf/renderer.h>

namespace fieldmark::watermark {

/// Data of one view of the frozen field for embedding, computed once because geometry and base colours do not
/// change during training. A pixel that sees something has one sample at the mean position along its ray, or
/// the heaviest parts of its ray: samples within half of the finest cell (1/128 of the cube's side) form one
/// part, at their weighted mean position and colour.
struct CachedView {
  Index height = 0;                        ///< pixels
  Index width = 0;                         ///< pixels
  Tensor<float> base;                      ///< [height, width, 3] over the background
  Tensor<float> opacity;                   ///< [height, width]
  std::vector<std::int32_t> sample_begin;  ///< [height width + 1]
  std::vector<float> position;             ///< [S, 3] unit cube
  std::vector<float> direction;            ///< [S, 3] unit, from the camera, in the world
  std::vector<float> colour;               ///< [S, 3] of the base field
  std::vector<float> weight;  ///< [S] share of the sample in its pixel; they sum to about the pixel's opacity
  nerf::Camera camera{};      ///< camera of the view
};

/// Marches the rays of one view and keeps their visible samples.
/// @param samples  samples per ray, at least 1. 1: one at the mean position; more: at most that many of its
/// heaviest parts, heaviest first, with weights scaled to sum to the opacity
/// @throws ValueError if samples < 1
CachedView cache_view(nerf::Renderer& renderer, const nerf::RadianceField& field, const nerf::Camera& camera,
                      Index samples = 1);

/// Returns 1 where a pixel's opacity exceeds 0.5 and the pixel has a sample, else 0. @return [height width]
std::vector<float> foreground_mask(const CachedView& view);

/// Returns the visible area of each place of a grid over the cube, summed over views. @return [side^3]
std::vector<double> visible_area(std::span<const CachedView> views, Index side);

}  // namespace fieldmark::watermark
