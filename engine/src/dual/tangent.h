#pragma once
// Helpers shared by the ops of Duals. Private.
#include <fieldmark/engine/dual.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/comparison.h>
#include <fieldmark/engine/ops/layout.h>

#include <algorithm>
#include <optional>

namespace fieldmark::detail {

// Without a value, the tangent is 0.
template <class T>
using Tangent = std::optional<Var<T>>;

// Returns f(x'), if there is a tangent.
template <class T, class F>
Tangent<T> tangent_by(const Dual<T>& x, F f) {
  return x.has_tangent() ? Tangent<T>(f(x.tangent())) : Tangent<T>();
}

template <class T>
Tangent<T> plus(Tangent<T> a, Tangent<T> b) {
  if (!a || !b) return a ? a : b;
  return add(*a, *b);
}

// Returns y with a tangent that broadcasts to it.
template <class T>
Dual<T> with_tangent(Var<T> y, Tangent<T> t) {
  if (!t) return y;
  return {y, t->shape() == y.shape() ? *t : broadcast_to(*t, y.shape())};
}

// y = f(x) of one operand, and y' = slope(x').
template <class T, class F>
Dual<T> with_tangent(Var<T> y, const Dual<T>& x, F slope) {
  return with_tangent(y, tangent_by(x, slope));
}

// A linear op: applies f to the value and to the tangent.
template <class T, class F>
Dual<T> linear(const Dual<T>& x, F f) {
  return with_tangent(f(x.value()), x, f);
}

template <class T>
Var<T> filled(Tape<T>& tape, Shape shape, double value) {
  T* data = tape.scratch(shape.size());
  std::fill_n(data, shape.size(), static_cast<T>(value));
  return tape.constant(data, shape);
}

// Returns t where the mask holds, 0 elsewhere, whatever t is there.
template <class T>
Var<T> only(Var<T> mask, Var<T> t) {
  return where(mask, t, filled(t.tape(), Shape{1}, 0));
}

template <class T>
Var<T> except(Var<T> mask, Var<T> t) {
  return where(mask, filled(t.tape(), Shape{1}, 0), t);
}

// y' of y = relu(s) from s': 0 where y is.
template <class T>
Tangent<T> rectified(bool relu, Var<T> y, Tangent<T> t) {
  if (!relu || !t) return t;
  return only(greater(y, filled(y.tape(), Shape{1}, 0)), *t);
}

}  // namespace fieldmark::detail
