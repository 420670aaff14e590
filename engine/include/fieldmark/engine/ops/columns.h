#pragma once
#include <fieldmark/engine/tape.h>

#include <initializer_list>
#include <span>

namespace fieldmark {

/// Joins tensors along their last axis: features [N, Ci], or the channels of images [N, H, W, Ci].
/// @param xs  one or more; the leading axes of all are the same
/// @return    [.., C0 + C1 + ..]
/// @throws ShapeError if the leading axes differ or a rank is 0   @throws ValueError if xs is empty
/// Differentiable in: every x.
template <class T>
Var<T> concat_columns(std::span<const Var<T>> xs);
/// The same for tensors listed at the call.
template <class T>
Var<T> concat_columns(std::initializer_list<Var<T>> xs) {
  return concat_columns(std::span<const Var<T>>(xs.begin(), xs.size()));
}

/// Columns begin .. begin + count - 1 of the last axis.
/// @param x [.., C]   @return [.., count]
/// @throws ShapeError if the range does not lie within the C columns
/// Differentiable in: x.
template <class T>
Var<T> columns(Var<T> x, Index begin, Index count);

}  // namespace fieldmark
