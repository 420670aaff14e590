#pragma once
#include <fieldmark/nerf/renderer.h>

namespace fieldmark::watermark {

/// What embedding needs of one view of the frozen field, computed once: geometry and base colours do not
/// change while the mark is learnt. A pixel that sees something has one sample at the mean position of what
/// its ray sees, or the heaviest parts of its ray: samples within half of the finest cell (1/128 of the
/// cube's side) are one part, at their mean place and colour by weight.
struct CachedView {
  Index height = 0;                        ///< pixels
  Index width = 0;                         ///< pixels
  Tensor<float> base;                      ///< [height, width, 3] over the background
  Tensor<float> opacity;                   ///< [height, width]
  std::vector<std::int32_t> sample_begin;  ///< [height width + 1]
  std::vector<float> position;             ///< [S, 3] unit cube
  std::vector<float> direction;            ///< [S, 3] unit, seen from the camera
  std::vector<float> colour;               ///< [S, 3] of the base field
  std::vector<float> weight;  ///< [S] share of the sample in its pixel; a pixel's sum is about its opacity
  nerf::Camera camera{};      ///< that sees it
};

/// Marches the rays of one view and keeps what they see.
/// @param samples  kept of a ray, at least 1. 1: one at the mean position; more: as many of its heaviest
/// parts, heaviest first, their weights scaled so that they sum to the opacity
/// @throws ValueError if samples < 1
CachedView cache_view(nerf::Renderer& renderer, const nerf::RadianceField& field, const nerf::Camera& camera,
                      Index samples = 1);

/// 1 where a pixel's opacity exceeds 0.5 and the pixel has a sample, else 0. @return [height width]
std::vector<float> foreground_mask(const CachedView& view);

/// Visible area of the cells of a grid over the cube, summed over views. @return [side^3]
std::vector<double> visible_area(std::span<const CachedView> views, Index side);

}  // namespace fieldmark::watermark
