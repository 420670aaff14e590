#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark {

// All functions accept any shape and return the same shape. As in the C library, a function is NaN outside
// its domain and infinite at a pole.

/// y = -x.      Differentiable in: x.
template <class T>
Var<T> negate(Var<T> x);

/// y = factor x + offset, in one pass over memory.      Differentiable in: x.
template <class T>
Var<T> affine(Var<T> x, double factor, double offset);

/// y = x / divisor.
/// @param divisor  any finite number but 0   @throws ValueError if it is 0      Differentiable in: x.
template <class T>
Var<T> div(Var<T> x, double divisor);

/// y = 1 / x.      Differentiable in: x, except at 0.
template <class T>
Var<T> reciprocal(Var<T> x);

/// y = |x|; the gradient at 0 is 0.      Differentiable in: x, except at 0.
template <class T>
Var<T> abs(Var<T> x);

/// y = x^2.      Differentiable in: x.
template <class T>
Var<T> square(Var<T> x);

/// y = sqrt x, NaN below 0.      Differentiable in: x > 0; infinite at 0.
template <class T>
Var<T> sqrt(Var<T> x);

/// y = x^p for a constant power, NaN where x is negative and p is not an integer.
/// @param p  any finite number
/// Differentiable in: x, except at 0 for p < 1; dy/dx = p x^(p - 1), 0 for p = 0.
template <class T>
Var<T> pow(Var<T> x, double p);

/// y = log x, natural; -infinity at 0, NaN below.      Differentiable in: x > 0.
template <class T>
Var<T> log(Var<T> x);

/// y = log(1 + x), accurate even for small x.      Differentiable in: x > -1.
template <class T>
Var<T> log1p(Var<T> x);

/// y = exp(x) - 1, accurate even for small x.      Differentiable in: x.
template <class T>
Var<T> expm1(Var<T> x);

/// y = sin x, x in radians.      Differentiable in: x.
template <class T>
Var<T> sin(Var<T> x);

/// y = cos x, x in radians.      Differentiable in: x.
template <class T>
Var<T> cos(Var<T> x);

/// y = min(max(x, low), high); NaN stays NaN. The gradient passes where low <= x <= high.
/// @throws ValueError unless low <= high      Differentiable in: x, except at low and high.
template <class T>
Var<T> clamp(Var<T> x, double low, double high);

}  // namespace fieldmark
