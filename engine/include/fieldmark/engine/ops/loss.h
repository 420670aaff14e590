#pragma once
#include <fieldmark/engine/tape.h>

#include <span>
#include <type_traits>

namespace fieldmark {

// Each loss is a mean over elements, sum_i w_i l_i / sum_i w_i, of shape [1].
// `weights` is empty (all 1) or has one value >= 0 for each element. Sums run in double.
// @throws ShapeError if shapes or sizes differ, or there are no elements
// @throws ValueError if a weight is negative or NaN, or all are 0

/// Computes the mean squared error, l_i = (a_i - b_i)^2.
/// Differentiable in: a, b.
template <class T>
Var<T> mse_loss(Var<T> a, Var<T> b, std::span<const std::type_identity_t<T>> weights = {});

/// Computes the mean absolute error, l_i = |a_i - b_i|.
/// Differentiable in: a, b, except where they are equal: the gradient is 0 there.
template <class T>
Var<T> l1_loss(Var<T> a, Var<T> b, std::span<const std::type_identity_t<T>> weights = {});

/// Computes Huber's loss with d = a_i - b_i: l_i = d^2 / 2 where |d| <= delta, else delta (|d| - delta / 2).
/// Source: Huber 1964, Robust estimation of a location parameter.
/// @param delta  where the parabola becomes a line, > 0   @throws ValueError if it is not
/// Differentiable in: a, b; the second derivative jumps at |d| = delta.
template <class T>
Var<T> huber_loss(Var<T> a, Var<T> b, double delta, std::span<const std::type_identity_t<T>> weights = {});

/// Computes the binary cross-entropy of logits x against targets t,
///   l = -t log s(x) - (1 - t) log(1 - s(x)) = max(x, 0) - x t + log(1 + exp(-|x|)),   s the sigmoid.
/// The second form neither overflows nor cancels: at x = +-100 it is exact to rounding.
/// @param targets  one in [0, 1] for each logit   @throws ValueError if one is outside
/// Differentiable in: logits.
template <class T>
Var<T> bce_with_logits(Var<T> logits, std::span<const std::type_identity_t<T>> targets,
                       std::span<const std::type_identity_t<T>> weights = {});

}  // namespace fieldmark
