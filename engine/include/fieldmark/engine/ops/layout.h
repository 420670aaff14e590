#pragma once
#include <fieldmark/engine/tape.h>

#include <initializer_list>
#include <span>

namespace fieldmark {

/// The same elements, row-major, under another shape.
/// @param shape  as many elements as x   @throws ShapeError if they are not      Differentiable in: x.
template <class T>
Var<T> reshape(Var<T> x, Shape shape);

/// Puts the axes into another order: axis k of y is axis order[k] of x.
/// @param order  each axis of x once; negative ones count from the last
/// @throws ShapeError if it has another length than x has axes, or an axis is out of range
/// @throws ValueError if an axis is named twice      Differentiable in: x.
template <class T>
Var<T> permute(Var<T> x, std::span<const int> order);
/// The same for an order listed at the call.
template <class T>
Var<T> permute(Var<T> x, std::initializer_list<int> order) {
  return permute(x, std::span<const int>(order.begin(), order.size()));
}

/// Exchanges two axes; without them the last two, as of matrices.
/// @throws ShapeError if an axis is out of range      Differentiable in: x.
template <class T>
Var<T> transpose(Var<T> x, int a = -2, int b = -1);

/// Repeats x along axes of extent 1 and along new axes in front, see arithmetic.h; ops that broadcast do so
/// by themselves.
/// @throws ShapeError if x does not broadcast to the shape
/// Differentiable in: x. The gradient of what repeats is summed in double.
template <class T>
Var<T> broadcast_to(Var<T> x, Shape shape);

/// Adds constant elements before and after those of one axis.
/// @param before, after  0 or more   @param value  of the new elements
/// @throws ShapeError if the axis is out of range   @throws ValueError if a count is negative
/// Differentiable in: x.
template <class T>
Var<T> pad(Var<T> x, int axis, Index before, Index after, double value = 0);

/// Running sums along an axis, y_i = x_0 + .. + x_i, in double.
/// @throws ShapeError if the axis is out of range      Differentiable in: x.
template <class T>
Var<T> cumsum(Var<T> x, int axis = -1);

/// The values of x as a constant: no gradient passes.
template <class T>
Var<T> detach(Var<T> x) {
  return x.tape().constant(x.value(), x.shape());
}

}  // namespace fieldmark
