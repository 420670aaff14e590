#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark::extractor {

/// Prepares images for a network: colours centred at 0, extents that are multiples of m.
///   y[n, i, j, c] = 2 x[n, i, j, c] - 1   for i < H - H mod m, j < W - W mod m
/// Drops bottom rows and right columns beyond the last multiple: padding would show an edge that is not in
/// the scene.
/// @param x [N, H, W, C] in [0, 1]   @param multiple  m, at least 1
/// @return [N, H - H mod m, W - W mod m, C]
/// @throws ShapeError if x is not rank 4   @throws ValueError if multiple is below 1
/// Differentiable in: x; the gradient of a dropped pixel is 0.
template <class T>
Var<T> centred_image(Var<T> x, Index multiple = 1);

}  // namespace fieldmark::extractor
