#pragma once
#include <fieldmark/engine/tape.h>

#include <initializer_list>
#include <span>
#include <vector>

namespace fieldmark {

/// Concatenates tensors along their last axis: features [N, Ci], or the channels of images [N, H, W, Ci].
/// @param xs  one or more, with the same leading axes
/// @return    [.., C0 + C1 + ..]
/// @throws ShapeError if the leading axes differ or a rank is 0   @throws ValueError if xs is empty
/// Differentiable in: every x.
template <class T>
Var<T> concatenate(std::span<const Var<T>> xs);
/// @{
/// Overload for a braced list or a vector of tensors.
template <class T>
Var<T> concatenate(std::initializer_list<Var<T>> xs) {
  return concatenate(std::span<const Var<T>>(xs.begin(), xs.size()));
}
template <class T>
Var<T> concatenate(const std::vector<Var<T>>& xs) {
  return concatenate(std::span<const Var<T>>(xs));
}
/// @}

/// Concatenates tensors along any axis.
/// @param xs  one or more, equal in all axes but this one   @param axis  negative: counts from the last
/// @throws ShapeError if other axes differ or the axis is out of range   @throws ValueError if xs is empty
/// Differentiable in: every x.
template <class T>
Var<T> concatenate(std::span<const Var<T>> xs, int axis);
/// @{
/// Overload for a braced list or a vector of tensors.
template <class T>
Var<T> concatenate(std::initializer_list<Var<T>> xs, int axis) {
  return concatenate(std::span<const Var<T>>(xs.begin(), xs.size()), axis);
}
template <class T>
Var<T> concatenate(const std::vector<Var<T>>& xs, int axis) {
  return concatenate(std::span<const Var<T>>(xs), axis);
}
/// @}

/// Returns entries begin .. begin + count - 1 of the last axis.
/// @param x [.., C]   @return [.., count]
/// @throws ShapeError if the range does not lie within C
/// Differentiable in: x.
template <class T>
Var<T> slice(Var<T> x, Index begin, Index count);

/// Returns entries begin .. begin + count - 1 of any axis.
/// @param axis  negative: counts from the last
/// @throws ShapeError if the axis is out of range or the range does not lie within it
/// Differentiable in: x.
template <class T>
Var<T> slice(Var<T> x, int axis, Index begin, Index count);

}  // namespace fieldmark
