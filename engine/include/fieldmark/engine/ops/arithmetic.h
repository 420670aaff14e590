#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark {

/// Elementwise sum a + b of two tensors of one shape.
/// @throws ShapeError if the shapes differ      Differentiable in: a, b.
template <class T>
Var<T> add(Var<T> a, Var<T> b);

/// Elementwise difference a - b of two tensors of one shape.
/// @throws ShapeError if the shapes differ      Differentiable in: a, b.
template <class T>
Var<T> sub(Var<T> a, Var<T> b);

/// Elementwise product a * b of two tensors of one shape.
/// @throws ShapeError if the shapes differ      Differentiable in: a, b.
template <class T>
Var<T> mul(Var<T> a, Var<T> b);

/// Every element times a constant.
/// @param factor  any finite number      Differentiable in: x.
template <class T>
Var<T> scale(Var<T> x, double factor);

}  // namespace fieldmark
