#pragma once
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/space.h>

namespace fieldmark::nerf {

/// Chooses the space of a data set's scene by its type.
///   - object, plain: the cube `bounds`, which silhouettes tighten later; the cube of camera_span() if
///     silhouettes show that the object extends beyond `bounds`, or the cameras see less than a 16th of its
///     side.
///   - forward: ndc, from a plane just in front of the nearest near bound, as wide as the cameras' views
///     between that plane and infinity.
///   - place: contracted. The inner cube is centred at the centre of camera_span() and reaches to the median
///   distance of a camera from it; rays begin at 2% of that distance.
/// @param data    at least one view   @param bounds  of a scene in a cube
/// @throws ValueError if cameras are at the point they look at
Space scene_space(const Dataset& data, const Bounds& bounds = {});

/// Returns true if an image has a pixel whose alpha is below 1.
bool has_alpha(const Dataset& data);

}  // namespace fieldmark::nerf
