#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark::distort {

/// Clamps to [0, 1] and rounds to 8 bits, as saving an image does; half a level rounds away from 0.
///   y_i = round(255 min(max(x_i, 0), 1)) / 255
/// Gradient: straight-through, that of the clamp alone: dx_i = dy_i for 0 <= x_i <= 1, else 0. The true
/// derivative of the rounding is 0 almost everywhere and would stop training, so finite differences cannot
/// confirm this one. Source: Bengio et al. 2013, straight-through estimator.
/// @param x  [any]   @return [x's shape], multiples of 1/255
template <class T>
Var<T> quantize8(Var<T> x);

}  // namespace fieldmark::distort
