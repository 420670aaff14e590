#pragma once
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/renderer.h>

namespace fieldmark::nerf {

/// Corrects a render for the exposure and white balance of its ground truth. Each half is corrected by the
/// affine colour map that best fits the other half, so that no pixel decides its own correction.
///   C' = M C + A o,   M, o = argmin sum |M C + A o - (T - (1 - A) b)|^2 + 1e-4 n (|M - I|^2 + |o|^2)
/// over the valid pixels, with the colour C and the opacity A of the render, both without the background b,
/// and the ground truth T over b. Source of the protocol: Martin-Brualla et al. 2021 (NeRF in the Wild), sec.
/// 4, which fits on the left half and measures on the right half.
/// @return [H, W, 3] over the background, in [0, 1]   @throws ShapeError if the sizes differ
Tensor<float> colour_fitted(const Rendering& render, const View& view, Background background);

}  // namespace fieldmark::nerf
