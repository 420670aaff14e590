#pragma once
#include <fieldmark/engine/tape.h>

#include <span>

namespace fieldmark::nerf {

/// Applies the exposure and white balance of each ray's image to its colour.
///   C'_r = (I + D_v[:, :3]) C_r + A_r D_v[:, 3],   A'_r = A_r,   v = image[r]
/// D = 0 is the identity. The offset is scaled by the opacity, so the map acts on straight colours and leaves
/// the background behind a ray unchanged.
/// @param rays    [R, 4] colour and opacity, see composite()
/// @param affine  [V, 12] D of each image, a 3 x 4 matrix row by row
/// @param image   [R] row of affine for each ray; must outlive the pass
/// @return [R, 4]   @throws ShapeError if sizes do not match   @throws ValueError if an image is not in [0,
/// V)
/// Differentiable in: rays and affine.
template <class T>
Var<T> colour_affine(Var<T> rays, Var<T> affine, std::span<const Index> image);

}  // namespace fieldmark::nerf
