#pragma once
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/space.h>

namespace fieldmark::nerf {

/// Which space a data set's scene is laid into.
///   - Images with alpha, and all of layout blender: a cube, `bounds`; their silhouettes tighten it later.
///   - Forward-facing captures: ndc, from a plane just before the nearest near bound, as wide as what the
///     cameras see between it and infinity.
///   - Other photographs: contracted. The inner cube is centred on what the cameras look at (the point
///   nearest
///     to all viewing axes, see camera_span()) and reaches to `reach` times the median distance of a camera
///     from it; rays begin at 2% of that distance.
/// @param data    at least one view   @param bounds  of a scene in a cube
/// @throws ValueError if cameras stand where they look
Space scene_space(const Dataset& data, const Bounds& bounds = {});

/// Whether an image has a pixel whose alpha is below 1.
bool has_alpha(const Dataset& data);

}  // namespace fieldmark::nerf
