#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark {

// All functions accept any shape and return the same shape; NaN stays NaN. The stated errors are those of the
// float path, which its test measures against double; the double path uses the C library.

/// y = max(x, 0); the gradient at 0 is 0.
/// Differentiable in: x, except at 0.
template <class T>
Var<T> relu(Var<T> x);

/// y = 1 / (1 + exp(-x)), without overflow.
/// Float: relative error below 4e-7 for x >= -87.3, 0 below that (where y < 1.2e-38).
/// Differentiable in: x; dy/dx = y (1 - y) saturates to 0 where y rounds to 1 (float: x > 17).
template <class T>
Var<T> sigmoid(Var<T> x);

/// y = tanh x.
/// Float: relative error below 3e-7 for every x, also near 0.
/// Differentiable in: x; dy/dx = 1 - y^2 saturates to 0 where |y| rounds to 1 (float: |x| > 9).
template <class T>
Var<T> tanh(Var<T> x);

/// y = exp x.
/// Float: relative error below 3e-7 for x in [-87.3, 88]; 0 below, and 1.65e38 = exp(88) above instead of
/// infinity.
/// Differentiable in: x; dy/dx = y, even where the float path saturates.
template <class T>
Var<T> exp(Var<T> x);

/// Exponential for densities: y = exp(min(x, 15)), so that one oversized step cannot overflow a training run.
/// The backward uses dy/dx = y even above 15, where the true derivative is 0, so that a density stuck there
/// can come down. Same error as exp.
/// Source: Mueller et al. 2022 (Instant NGP), density activation, whose code clamps only the gradient, at 15.
/// Differentiable in: x; straight through above 15.
template <class T>
Var<T> truncated_exp(Var<T> x);

/// y = log(1 + exp x), without overflow.
/// Float: relative error below 4e-7 for x >= -87.3, 0 below that.
/// Differentiable in: x.
template <class T>
Var<T> softplus(Var<T> x);

}  // namespace fieldmark
