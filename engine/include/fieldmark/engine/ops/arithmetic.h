#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark {

// Ops of two tensors broadcast: shapes are aligned at their last axes, and an axis that has extent 1 or is
// missing repeats along the other's. Gradients of repeated elements are summed in double, with the same bits
// for any thread count.
//   [5, 3] with [3] -> [5, 3]      [4, 1, 3] with [5, 1] -> [4, 5, 3]      any shape with [1] or []
// operators.h provides them as operators: a + b, a * b + 1.0f ...

/// Computes the elementwise sum a + b with broadcasting.
/// @throws ShapeError if the shapes do not broadcast      Differentiable in: a, b.
template <class T>
Var<T> add(Var<T> a, Var<T> b);

/// Computes the elementwise difference a - b with broadcasting.
/// @throws ShapeError if the shapes do not broadcast      Differentiable in: a, b.
template <class T>
Var<T> sub(Var<T> a, Var<T> b);

/// Computes the elementwise product a * b with broadcasting.
/// @throws ShapeError if the shapes do not broadcast      Differentiable in: a, b.
template <class T>
Var<T> mul(Var<T> a, Var<T> b);

/// Computes the elementwise quotient a / b with broadcasting; infinite or NaN where b is 0.
///   da = dy / b,   db = -dy a / b^2
/// @throws ShapeError if the shapes do not broadcast      Differentiable in: a, b, except where b = 0.
template <class T>
Var<T> div(Var<T> a, Var<T> b);

/// Computes the elementwise power a^b with broadcasting; NaN where a is negative and b is not an integer.
///   da = dy b a^(b - 1), 0 where b = 0;   db = dy a^b log a, 0 where a = 0 and b >= 0
/// @throws ShapeError if the shapes do not broadcast
/// Differentiable in: a, b, where a > 0; in a alone also where a <= 0 and b is an integer that allows it.
template <class T>
Var<T> pow(Var<T> a, Var<T> b);

/// Computes the elementwise minimum of a and b with broadcasting; NaN where either is NaN.
/// The gradient goes to the smaller one, or to a where both are equal.
/// @throws ShapeError if the shapes do not broadcast      Differentiable in: a, b, except where a = b.
template <class T>
Var<T> minimum(Var<T> a, Var<T> b);

/// Computes the elementwise maximum of a and b with broadcasting; NaN where either is NaN.
/// The gradient goes to the larger one, or to a where both are equal.
/// @throws ShapeError if the shapes do not broadcast      Differentiable in: a, b, except where a = b.
template <class T>
Var<T> maximum(Var<T> a, Var<T> b);

/// Multiplies every element by a constant.
/// @param factor  any finite number      Differentiable in: x.
template <class T>
Var<T> scale(Var<T> x, double factor);

}  // namespace fieldmark
