#pragma once
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/space.h>

namespace fieldmark::nerf {

/// Chooses the space of a data set's scene.
///   - Images with alpha, and layout blender: the cube `bounds`, which silhouettes tighten later.
///   - Forward-facing captures: ndc, from a plane just before the nearest near bound, as wide as the cameras'
///   views
///     between that plane and infinity.
///   - Others: contracted. The inner cube is centred at the centre of camera_span() and reaches to the median
///   distance
///     of a camera from it; rays begin at 2% of that distance.
/// @param data    at least one view   @param bounds  of a scene in a cube
/// @throws ValueError if cameras stand at the point they look at
Space scene_space(const Dataset& data, const Bounds& bounds = {});

/// Whether an image has a pixel whose alpha is below 1.
bool has_alpha(const Dataset& data);

}  // namespace fieldmark::nerf
