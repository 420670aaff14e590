#pragma once
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/space.h>

namespace fieldmark::nerf {

/// Chooses the space of a data set's scene by its type.
///   - object, plain: the cube `bounds`, which silhouettes tighten later; where silhouettes show that the
///   object reaches out of it, or the cameras see less than a 16th of its side, the cube of camera_span().
///   - forward: ndc, from a plane just before the nearest near bound, as wide as the cameras' views between
///   that plane and infinity.
///   - place: contracted. The inner cube is centred at the centre of camera_span() and reaches to the median
///   distance of a camera from it; rays begin at 2% of that distance.
/// @param data    at least one view   @param bounds  of a scene in a cube
/// @throws ValueError if cameras stand at the point they look at
Space scene_space(const Dataset& data, const Bounds& bounds = {});

/// Whether an image has a pixel whose alpha is below 1.
bool has_alpha(const Dataset& data);

}  // namespace fieldmark::nerf
