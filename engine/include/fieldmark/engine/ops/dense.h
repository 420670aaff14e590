#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark {

/// Activation that an op applies to its sums.
enum class Activation { none, relu };

/// Applies an affine map and an activation to rows.
///   y = act(x W + b)
/// @param x  [N, in]   @param w  [in, out]   @param b  [out]   @return [N, out]
/// @throws ShapeError if they do not fit
/// Differentiable in: x, w, b. With relu: a kink where x W + b = 0, gradient 0 there.
template <class T>
Var<T> dense(Var<T> x, Var<T> w, Var<T> b, Activation activation = Activation::none);

}  // namespace fieldmark
