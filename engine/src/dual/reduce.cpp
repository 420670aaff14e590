#include <fieldmark/engine/dual/reduce.h>
#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/math.h>
#include <fieldmark/engine/ops/operators.h>

#include <algorithm>
#include <limits>

#include "dual/tangent.h"

namespace fieldmark {

using detail::linear;
using detail::with_tangent;

namespace {

// Returns a constant that is 1 at the elements that `choose` takes and 0 elsewhere: its gradient, from a
// separate tape.
template <class T, class F>
Var<T> origin(Var<T> x, F choose) {
  Tape<T> tape;
  const Index n = x.shape().size();
  T* mask = x.tape().scratch(n);
  std::fill_n(mask, n, T(0));
  tape.backward(sum(choose(tape.leaf(x.value(), mask, x.shape()))));
  return x.tape().constant(mask, x.shape());
}

// y (x' - sum y x') over one axis.
template <class T>
Dual<T> softmax_with_tangent(Var<T> y, const Dual<T>& x, int axis) {
  return with_tangent(y, x, [=](Var<T> t) { return y * (t - sum(y * t, {axis}, KeepAxes::yes)); });
}

}  // namespace

template <class T>
Dual<T> sum(const Dual<T>& x) {
  return linear(x, [](Var<T> v) { return sum(v); });
}

template <class T>
Dual<T> mean(const Dual<T>& x) {
  return linear(x, [](Var<T> v) { return mean(v); });
}

template <class T>
Dual<T> weighted_mean(const Dual<T>& x, std::span<const std::type_identity_t<T>> weights) {
  return linear(x, [=](Var<T> v) { return weighted_mean<T>(v, weights); });
}

template <class T>
Dual<T> sum(const Dual<T>& x, const Axes& axes, KeepAxes keep) {
  return linear(x, [&](Var<T> v) { return sum(v, axes, keep); });
}

template <class T>
Dual<T> mean(const Dual<T>& x, const Axes& axes, KeepAxes keep) {
  return linear(x, [&](Var<T> v) { return mean(v, axes, keep); });
}

template <class T>
Dual<T> variance(const Dual<T>& x, const Axes& axes, KeepAxes keep) {
  return with_tangent(variance(x.value(), axes, keep), x, [&](Var<T> t) {
    const Var<T> deviation = x.value() - mean(x.value(), axes, KeepAxes::yes);
    return T(2) * mean(deviation * t, axes, keep);
  });
}

template <class T>
Dual<T> max(const Dual<T>& x, const Axes& axes, KeepAxes keep) {
  return with_tangent(max(x.value(), axes, keep), x, [&](Var<T> t) {
    const Var<T> largest = origin(x.value(), [&](Var<T> v) { return max(v, axes); });
    return sum(detail::only(largest, t), axes, keep);
  });
}

// Where all x are -infinity, so is y, and x - y would be NaN; the tangent is 0 there.
template <class T>
Dual<T> logsumexp(const Dual<T>& x, const Axes& axes, KeepAxes keep) {
  return with_tangent(logsumexp(x.value(), axes, keep), x, [&](Var<T> t) {
    const Var<T> y = logsumexp(x.value(), axes, KeepAxes::yes);
    const Var<T> lowest = detail::filled(x.tape(), Shape{1}, -std::numeric_limits<double>::infinity());
    return sum(exp(x.value() - detail::except(equal(y, lowest), y)) * t, axes, keep);
  });
}

template <class T>
Dual<T> softmax(const Dual<T>& x, int axis) {
  return softmax_with_tangent(softmax(x.value(), axis), x, axis);
}

template <class T>
Dual<T> softmax(const Dual<T>& x) {
  return softmax_with_tangent(softmax(x.value()), x, -1);
}

#define FIELDMARK_DUAL_REDUCE(T)                                      \
  template Dual<T> sum(const Dual<T>&);                               \
  template Dual<T> mean(const Dual<T>&);                              \
  template Dual<T> weighted_mean(const Dual<T>&, std::span<const T>); \
  template Dual<T> sum(const Dual<T>&, const Axes&, KeepAxes);        \
  template Dual<T> mean(const Dual<T>&, const Axes&, KeepAxes);       \
  template Dual<T> variance(const Dual<T>&, const Axes&, KeepAxes);   \
  template Dual<T> max(const Dual<T>&, const Axes&, KeepAxes);        \
  template Dual<T> logsumexp(const Dual<T>&, const Axes&, KeepAxes);  \
  template Dual<T> softmax(const Dual<T>&, int);                      \
  template Dual<T> softmax(const Dual<T>&);
FIELDMARK_DUAL_REDUCE(float)
FIELDMARK_DUAL_REDUCE(double)
#undef FIELDMARK_DUAL_REDUCE

}  // namespace fieldmark
