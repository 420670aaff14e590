#pragma once
#include <fieldmark/engine/tape.h>

#include <cstdint>
#include <span>
#include <type_traits>

namespace fieldmark {

/// Applies softmax over the last axis, shifted by the row's maximum so that nothing overflows.
///   y_c = exp(x_c - m) / sum_k exp(x_k - m),   m = max_k x_k
/// @param x [.., C], C >= 1   @return [.., C]; each row sums to 1
/// @throws ShapeError if x has no columns
/// Differentiable in: x.
template <class T>
Var<T> softmax(Var<T> x);

/// Computes the cross-entropy of logits against class labels, a weighted mean over rows:
///   L = sum_r w_r (log sum_k exp x[r, k] - x[r, label_r]) / sum_r w_r   over the rows whose label is not -1
/// @param logits [.., C], C >= 1   @param labels  one in [-1, C) for each row, -1 = ignored
/// @param weights  empty (all 1) or one >= 0 for each row
/// @return [1]
/// @throws ShapeError if sizes differ or there is no row   @throws ValueError if a label or a weight is
/// outside its range, or every row is ignored or has weight 0
/// Differentiable in: logits.
template <class T>
Var<T> softmax_cross_entropy(Var<T> logits, std::span<const std::int32_t> labels,
                             std::span<const std::type_identity_t<T>> weights = {});

}  // namespace fieldmark
