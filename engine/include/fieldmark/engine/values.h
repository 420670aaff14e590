#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark {

/// Returns the one element of a loss or another single value.
/// @throws ShapeError unless there is exactly one
template <class T>
T item(Var<T> v) {
  if (v.shape().size() != 1) throw ShapeError("[item] v must have one element, got shape " + v.shape().str());
  return v.value()[0];
}

/// Returns a copy of the values, which outlives the pass.
template <class T>
Tensor<T> to_tensor(Var<T> v) {
  return Tensor<T>(v.shape(), std::vector<T>(v.value(), v.value() + v.shape().size()));
}

/// Returns a copy of the gradient dL/dv of the last backward pass; zeros if none reached v.
template <class T>
Tensor<T> grad_to_tensor(Var<T> v) {
  if (!v.grad()) return Tensor<T>(v.shape());
  return Tensor<T>(v.shape(), std::vector<T>(v.grad(), v.grad() + v.shape().size()));
}

}  // namespace fieldmark
