#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark {

// Relatives of relu(). All functions accept any shape and return the same shape; NaN stays NaN.

/// y = x where x > 0, else slope x.
/// @param slope  any finite number      Differentiable in: x, except at 0, where the gradient is slope.
template <class T>
Var<T> leaky_relu(Var<T> x, double slope = 0.01);

/// Exponential linear unit: y = x where x > 0, else alpha (exp(x) - 1).
/// Source: Clevert et al. 2016, eq. 16.
/// @param alpha  any finite number      Differentiable in: x; a kink at 0 unless alpha is 1.
template <class T>
Var<T> elu(Var<T> x, double alpha = 1);

/// Sigmoid-weighted linear unit, also called swish: y = x s(x), s(x) = 1 / (1 + exp(-x)).
/// Source: Elfwing et al. 2018, eq. 2.      Differentiable in: x; dy/dx = s (1 + x (1 - s)).
template <class T>
Var<T> silu(Var<T> x);

/// Gaussian error linear unit: y = x P(x), P the distribution function of the standard normal.
/// Source: Hendrycks and Gimpel 2016, section 2; exact, without their tanh approximation.
/// Differentiable in: x; dy/dx = P(x) + x exp(-x^2 / 2) / sqrt(2 pi).
template <class T>
Var<T> gelu(Var<T> x);

/// Distribution function P of the standard normal: y = (1 + erf(x / sqrt 2)) / 2, without cancellation far
/// below 0.      Differentiable in: x; dy/dx = exp(-x^2 / 2) / sqrt(2 pi).
template <class T>
Var<T> normal_cdf(Var<T> x);

}  // namespace fieldmark
