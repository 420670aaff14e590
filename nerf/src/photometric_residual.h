#pragma once
#include <fieldmark/engine/shape.h>

namespace fieldmark::nerf {

// e of photometric_loss(), channel k of one ray: rgba composited, straight rgba of the photograph,
// background.
template <class T>
inline T photometric_residual(const T* ray, const T* photograph, const T* background, Index k) {
  return ray[k] - photograph[3] * photograph[k] + (photograph[3] - ray[3]) * background[k];
}

}  // namespace fieldmark::nerf
