#pragma once
#include <fieldmark/engine/tape.h>

#include <span>
#include <type_traits>

namespace fieldmark::distort {

/// Rotates an image about its centre, keeping its size, bilinear: affine_warp of similarity(angle, 1, 0).
/// Exact for 0, and for multiples of pi/2 where the size allows (height - width even).
/// @param x           [height, width, channels]
/// @param angle       [1] radians, counter-clockwise as seen
/// @param background  [channels] colour of the corners that are exposed; empty = 0. Copied
/// @return [height, width, channels]
/// @throws ShapeError and ValueError as affine_warp and similarity
/// Differentiable in: x, angle. Kinks as affine_warp.
template <class T>
Var<T> rotate(Var<T> x, Var<T> angle, std::span<const std::type_identity_t<T>> background = {});

}  // namespace fieldmark::distort
