#pragma once
#include <fieldmark/nerf/dataset.h>

#include <array>
#include <span>
#include <string>

namespace fieldmark::nerf {

/// What images reveal about their scene.
struct SceneLook {
  SceneType type = SceneType::place;
  std::string reason{};           ///< text: "97% of the pixels at the images' borders are transparent"
  std::array<float, 3> colour{};  ///< the most frequent colour at the borders
  float tolerance = 0;            ///< largest deviation of the background of `plain` from it, in any channel
};

/// Decides the type of a scene from its images and cameras.
///   - forward, if `forward_facing`.
///   - object, if at least half of the pixels at the images' borders are transparent, and the opaque ones do
///     not form a rectangle (or disc) at the same place in most images, which is a frame.
///   - plain, if the images are opaque, the borders of 9 in 10 images have the same colour at 4 of 5 pixels,
///     and the pixels that differ from it form no such rectangle.
///   - else place.
/// @param views  at least one
SceneLook look_at_scene(std::span<const View> views, bool forward_facing);

/// Makes the background of an image transparent: the pixels within `tolerance` of `colour` that are connected
/// to the border. A margin of one pixel around the others stays opaque, to keep edges.
void cut_out(View& view, const std::array<float, 3>& colour, float tolerance);

/// Sets what depends on the scene type of a data set: type, reason, background and, for a plain scene, the
/// alpha of its images.
/// @param data  views as in their files   @param forward_facing  true if the layout has depth bounds and all
/// cameras look one way
/// @throws ValueError if the views cannot have the requested type
void settle_scene(Dataset& data, const DatasetOptions& options, bool forward_facing);

}  // namespace fieldmark::nerf
