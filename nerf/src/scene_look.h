#pragma once
#include <fieldmark/nerf/dataset.h>

#include <array>
#include <span>
#include <string>

namespace fieldmark::nerf {

/// What images tell of their scene.
struct SceneLook {
  SceneType type = SceneType::place;
  std::string reason{};           ///< for people: "97% of the pixels at the images' borders are transparent"
  std::array<float, 3> colour{};  ///< the one most frequent at the borders
  float tolerance = 0;            ///< how far the background of `plain` strays from it, in any channel
};

/// Decides the type of a scene from its images and cameras.
///   - forward, if `forward_facing`.
///   - object, if at least half of the pixels at the images' borders are transparent, and the opaque ones are
///   not a rectangle (or disc) at one place of most images: that is a frame.
///   - plain, if the images are opaque, the borders of 9 in 10 images have one colour, the same in all, at 4
///   of 5 pixels, and what differs from it is no such rectangle.
///   - else place.
/// @param views  at least one
SceneLook look_at_scene(std::span<const View> views, bool forward_facing);

/// Makes the background of an image transparent: the pixels within `tolerance` of `colour` that hang together
/// with the border. A pixel around the others stays opaque, so that edges are kept.
void cut_out(View& view, const std::array<float, 3>& colour, float tolerance);

/// Sets what depends on the type of a data set's scene: type, reason, background; of a plain scene the alpha
/// of its images.
/// @param data  views read, as in their files   @param forward_facing  whether the layout has depth bounds
/// and all cameras look one way
/// @throws ValueError if the views cannot be of the type asked for
void settle_scene(Dataset& data, const DatasetOptions& options, bool forward_facing);

}  // namespace fieldmark::nerf
