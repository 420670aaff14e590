#pragma once
#include <fieldmark/engine/dual.h>
#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/math.h>
#include <fieldmark/engine/ops/relu_family.h>

namespace fieldmark {

// The elementwise functions of activation.h, math.h and relu_family.h for Duals: y' = f'(x) x', with the f'
// of their backward, even at kinks.

/// @{
/// Applies the function of math.h with its tangent.
template <class T>
Dual<T> negate(const Dual<T>& x);
template <class T>
Dual<T> affine(const Dual<T>& x, double factor, double offset);
template <class T>
Dual<T> div(const Dual<T>& x, double divisor);
template <class T>
Dual<T> reciprocal(const Dual<T>& x);
template <class T>
Dual<T> abs(const Dual<T>& x);
template <class T>
Dual<T> square(const Dual<T>& x);
template <class T>
Dual<T> sqrt(const Dual<T>& x);
template <class T>
Dual<T> pow(const Dual<T>& x, double p);
template <class T>
Dual<T> log(const Dual<T>& x);
template <class T>
Dual<T> log1p(const Dual<T>& x);
template <class T>
Dual<T> expm1(const Dual<T>& x);
template <class T>
Dual<T> sin(const Dual<T>& x);
template <class T>
Dual<T> cos(const Dual<T>& x);
template <class T>
Dual<T> clamp(const Dual<T>& x, double low, double high);
/// @}

/// @{
/// Applies the function of activation.h with its tangent.
template <class T>
Dual<T> relu(const Dual<T>& x);
template <class T>
Dual<T> sigmoid(const Dual<T>& x);
template <class T>
Dual<T> tanh(const Dual<T>& x);
template <class T>
Dual<T> exp(const Dual<T>& x);
template <class T>
Dual<T> truncated_exp(const Dual<T>& x);
template <class T>
Dual<T> softplus(const Dual<T>& x);
/// @}

/// @{
/// Applies the function of relu_family.h with its tangent.
template <class T>
Dual<T> leaky_relu(const Dual<T>& x, double slope = 0.01);
template <class T>
Dual<T> elu(const Dual<T>& x, double alpha = 1);
template <class T>
Dual<T> silu(const Dual<T>& x);
template <class T>
Dual<T> gelu(const Dual<T>& x);
template <class T>
Dual<T> normal_cdf(const Dual<T>& x);
/// @}

}  // namespace fieldmark
