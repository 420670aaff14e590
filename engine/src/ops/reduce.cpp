#include <fieldmark/engine/ops/reduce.h>

#include "ops/weights.h"

namespace fieldmark {

template <class T>
Var<T> sum(Var<T> x) {
  T* y = nullptr;
  const Var<T> out = x.tape().output({1}, &y, {x});
  *y = static_cast<T>(
      detail::chunked_sum(x.tape(), x.shape().size(), [v = x.value()](Index i) { return v[i]; }));
  // dx_i = dy. A chunk owns its elements.
  x.tape().on_backward(out, [x](const T* dy) { detail::add_gradient(x, [g = *dy](Index) { return g; }); });
  return out;
}

template <class T>
Var<T> mean(Var<T> x) {
  return detail::mean_of<T>(
      "mean", x, nullptr, {}, [v = x.value()](Index i) { return v[i]; }, [](Index) { return T(1); });
}

template <class T>
Var<T> weighted_mean(Var<T> x, std::span<const std::type_identity_t<T>> weights) {
  if (weights.empty() && x.shape().size() > 0)
    throw ShapeError("[weighted_mean] weights must have one element for each of the " +
                     std::to_string(x.shape().size()) + " averaged, got 0");
  return detail::mean_of<T>(
      "weighted_mean", x, nullptr, weights, [v = x.value()](Index i) { return v[i]; },
      [](Index) { return T(1); });
}

template Var<float> sum(Var<float>);
template Var<double> sum(Var<double>);
template Var<float> mean(Var<float>);
template Var<double> mean(Var<double>);
template Var<float> weighted_mean(Var<float>, std::span<const float>);
template Var<double> weighted_mean(Var<double>, std::span<const double>);

}  // namespace fieldmark
