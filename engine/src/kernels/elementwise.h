#pragma once
#include <fieldmark/engine/kernel.h>

namespace fieldmark::kernels {

enum class Unary { relu, sigmoid, tanh, exp, truncated_exp, softplus };
/// Largest exponent of truncated_exp: e^15 = 3.3e6.
constexpr double kTruncatedExpLimit = 15;

// T is float or double. y[i] = f(x[i]); then dx[i] = or += dy[i] f'(x[i]).
FIELDMARK_DECLARE_KERNEL(template <class T> void, unary_forward, (Unary f, const T* x, T* y, Index n))
FIELDMARK_DECLARE_KERNEL(template <class T> void, unary_backward,
                         (Unary f, const T* x, const T* y, const T* dy, T* dx, bool add, Index n))
// y[i] = exp(x[i] - shift); returns their sum. The order of additions depends on the instruction set.
FIELDMARK_DECLARE_KERNEL(template <class T> T, exp_sum, (const T* x, T shift, T* y, Index n))

}  // namespace fieldmark::kernels
