#pragma once
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/renderer.h>

#include <functional>
#include <span>

namespace fieldmark::nerf {

/// Images of a field as a data set: what somebody has who trains a new field, or the same one further, on
/// what it shows. Numbers are rounded to 8 bits as files keep them. In a cube, alpha is the rendering's
/// opacity a and colours are straight, (C - (1 - a) b) / a with the background b; in other spaces everything
/// is opaque, as in photographs.
/// @param cameras   at least one, all of one size
/// @param progress  called after each view; returns false to stop, which throws Error
/// @return split "train"; layout blender for a cube, else transforms   @throws ValueError if there are no
/// cameras, or of several sizes
Dataset rendered_dataset(const RadianceField& field, std::span<const Camera> cameras,
                         const std::function<bool(Index done, Index total)>& progress = {});

}  // namespace fieldmark::nerf
