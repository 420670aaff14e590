#pragma once
#include <fieldmark/engine/tape.h>

#include <initializer_list>
#include <span>

namespace fieldmark {

/// Returns the same elements, row-major, under another shape.
/// @param shape  with as many elements as x   @throws ShapeError if the count differs
/// Differentiable in: x.
template <class T>
Var<T> reshape(Var<T> x, Shape shape);

/// Permutes the axes: axis k of y is axis order[k] of x.
/// @param order  each axis of x once; negative ones count from the last
/// @throws ShapeError if its length is not the rank of x, or an axis is out of range
/// @throws ValueError if an axis is named twice      Differentiable in: x.
template <class T>
Var<T> permute(Var<T> x, std::span<const int> order);
/// Overload for a braced list of axes.
template <class T>
Var<T> permute(Var<T> x, std::initializer_list<int> order) {
  return permute(x, std::span<const int>(order.begin(), order.size()));
}

/// Swaps two axes; by default the last two, those of matrices.
/// @throws ShapeError if an axis is out of range      Differentiable in: x.
template <class T>
Var<T> transpose(Var<T> x, int a = -2, int b = -1);

/// Repeats x along axes of extent 1 and along new leading axes, see arithmetic.h. Ops that broadcast do this
/// on their own.
/// @throws ShapeError if x does not broadcast to the shape
/// Differentiable in: x. Gradients of repeated elements are summed in double.
template <class T>
Var<T> broadcast_to(Var<T> x, Shape shape);

/// Pads one axis with constant elements before and after.
/// @param before, after  0 or more   @param value  of the new elements
/// @throws ShapeError if the axis is out of range   @throws ValueError if a count is negative
/// or the result has 2^60 elements or more
/// Differentiable in: x.
template <class T>
Var<T> pad(Var<T> x, int axis, Index before, Index after, double value = 0);

/// Computes running sums along an axis, y_i = x_0 + .. + x_i, in double.
/// @throws ShapeError if the axis is out of range      Differentiable in: x.
template <class T>
Var<T> cumsum(Var<T> x, int axis = -1);

/// Returns the values of x as a constant, which passes no gradient.
template <class T>
Var<T> detach(Var<T> x) {
  return x.tape().constant(x.value(), x.shape());
}

}  // namespace fieldmark
