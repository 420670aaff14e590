#pragma once
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/renderer.h>

#include <functional>
#include <span>

namespace fieldmark::nerf {

/// Renders a field as a data set, to train another field or to continue training the same one. Images are
/// rounded to 8 bits, as in files. In a cube, alpha is the opacity a and colours are straight, (C - (1 - a)
/// b) / a with the background b; in other spaces all images are opaque.
/// @param cameras   at least one, all of the same size
/// @param progress  called after each view; returns false to stop, which throws Error
/// @return split "train"; layout blender and scene object for a cube, else transforms and place
/// @throws ValueError if there are no cameras, or their sizes differ
Dataset rendered_dataset(const RadianceField& field, std::span<const Camera> cameras,
                         const std::function<bool(Index done, Index total)>& progress = {});

}  // namespace fieldmark::nerf
