#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark {

/// Products of matrices in batches.
///   y[.., i, j] = sum_k a[.., i, k] b[.., k, j]
/// The axes before the last two broadcast, see arithmetic.h: one matrix can serve all others.
/// @param a  [.., m, k]   @param b  [.., k, n]   @return [.., m, n]
/// @throws ShapeError if a rank is below 2, the inner extents differ or the other axes do not broadcast
/// Differentiable in: a, b. The gradient of what repeats sums in the order of the batch.
template <class T>
Var<T> batched_matmul(Var<T> a, Var<T> b);

}  // namespace fieldmark
