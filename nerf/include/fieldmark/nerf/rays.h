#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark::nerf {

/// Computes rays through pixels like pixel_ray(), with gradients to the camera, so that pose and focal length
/// can be fitted.
///   o = t,   d = w / |w|,   w = R (u, v, -1),   u = (x + 1/2 - cx) / fx,   v = -(y + 1/2 - cy) / fy
/// @param camera  [16] or [N, 16]: the pose [R | t], row-major 3 x 4, then fx, fy, cx, cy in pixels; one for
///                all pixels or one for each. R need not be a rotation.
/// @param pixels  [N, 2] x and y, integers at pixel centres
/// @return        [N, 6] origin, then unit direction
/// @throws ShapeError  if camera or pixels have other shapes
/// Differentiable in: camera, pixels; not where w = 0, which no rotation gives.
template <class T>
Var<T> rays(Var<T> camera, Var<T> pixels);

}  // namespace fieldmark::nerf
