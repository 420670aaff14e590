#pragma once
#include <fieldmark/engine/tape.h>
#include <fieldmark/engine/tensor.h>

#include <cstdint>
#include <span>
#include <type_traits>

namespace fieldmark::distort {

/// Turns an image about its centre, same size, bilinear: affine_warp of similarity(angle, 1, 0).
/// Exact for 0, and for multiples of pi/2 where the size allows (height - width even).
/// @param x           [height, width, channels]
/// @param angle       [1] radians, counter-clockwise as seen
/// @param background  [channels] colour of the corners that open; empty = 0. Copied
/// @return [height, width, channels]
/// @throws ShapeError and ValueError as affine_warp and similarity
/// Differentiable in: x, angle. Kinks as affine_warp.
template <class T>
Var<T> rotate(Var<T> x, Var<T> angle, std::span<const std::type_identity_t<T>> background = {});

/// Moves labels [height, width] as rotate moves colours: nearest, `background` in the corners. @throws as
/// above
template <class T>
Tensor<std::int32_t> rotate_labels(const Tensor<std::int32_t>& labels, T angle, std::int32_t background);

}  // namespace fieldmark::distort
