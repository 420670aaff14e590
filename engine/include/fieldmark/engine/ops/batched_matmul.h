#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark {

/// Computes matrix products in batches.
///   y[.., i, j] = sum_k a[.., i, k] b[.., k, j]
/// The axes before the last two broadcast, see arithmetic.h: one matrix can multiply a whole batch.
/// @param a  [.., m, k]   @param b  [.., k, n]   @return [.., m, n]
/// @throws ShapeError if a rank is below 2, the inner extents differ or the other axes do not broadcast
/// Differentiable in: a, b. Gradients of repeated matrices are summed in batch order.
template <class T>
Var<T> batched_matmul(Var<T> a, Var<T> b);

}  // namespace fieldmark
