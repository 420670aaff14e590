#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/shape_checks.h>

#include <cmath>

#include "ops/weights.h"

namespace fieldmark {

template <class T>
Var<T> mse_loss(Var<T> a, Var<T> b, std::span<const std::type_identity_t<T>> weights) {
  check_same("mse_loss", "a", a.shape(), "b", b.shape());
  const T *av = a.value(), *bv = b.value();
  const auto value = [=](Index i) {
    const double d = static_cast<double>(av[i] - bv[i]);
    return d * d;
  };
  return detail::mean_of("mse_loss", a, &b, weights, value, [=](Index i) { return 2 * (av[i] - bv[i]); });
}

template <class T>
Var<T> l1_loss(Var<T> a, Var<T> b, std::span<const std::type_identity_t<T>> weights) {
  check_same("l1_loss", "a", a.shape(), "b", b.shape());
  const T *av = a.value(), *bv = b.value();
  return detail::mean_of(
      "l1_loss", a, &b, weights, [=](Index i) { return std::abs(static_cast<double>(av[i] - bv[i])); },
      [=](Index i) {
        const T d = av[i] - bv[i];
        return d > 0 ? T(1) : d < 0 ? T(-1) : T(0) * d;
      });
}

template <class T>
Var<T> huber_loss(Var<T> a, Var<T> b, double delta, std::span<const std::type_identity_t<T>> weights) {
  check_same("huber_loss", "a", a.shape(), "b", b.shape());
  check_number("huber_loss", "delta", delta, delta > 0, "above 0");
  const T *av = a.value(), *bv = b.value();
  const auto value = [=](Index i) {
    const double d = std::abs(static_cast<double>(av[i] - bv[i]));
    return d <= delta ? d * d / 2 : delta * (d - delta / 2);
  };
  const T limit = static_cast<T>(delta);
  return detail::mean_of("huber_loss", a, &b, weights, value,
                         [=](Index i) { return std::clamp(av[i] - bv[i], -limit, limit); });
}

template <class T>
Var<T> bce_with_logits(Var<T> logits, std::span<const std::type_identity_t<T>> targets,
                       std::span<const std::type_identity_t<T>> weights) {
  const Index n = logits.shape().size();
  if (static_cast<Index>(targets.size()) != n)
    throw ShapeError(
        "[bce_with_logits] targets must have one element for each of the logits, whose shape is " +
        logits.shape().str() + ", got " + std::to_string(targets.size()));
  for (std::size_t i = 0; i < targets.size(); ++i)
    if (!(targets[i] >= 0 && targets[i] <= 1))
      throw ValueError("[bce_with_logits] targets: entry " + std::to_string(i) + " must be in [0, 1], got " +
                       number_text(targets[i]));
  const T *x = logits.value(), *t = detail::kept(logits.tape(), targets);
  const auto value = [=](Index i) {
    return std::max(x[i], T(0)) - x[i] * t[i] + std::log1p(std::exp(-std::abs(x[i])));
  };
  // dl/dx = s(x) - t, computed for x > 0 as (1 - t) - s(-x), so that a correct and confident bit keeps its
  // tiny slope.
  const auto slope = [=](Index i) {
    const T e = std::exp(-std::abs(x[i])), small = e / (1 + e);
    return x[i] > 0 ? (1 - t[i]) - small : small - t[i];
  };
  return detail::mean_of<T>("bce_with_logits", logits, nullptr, weights, value, slope);
}

template Var<float> mse_loss(Var<float>, Var<float>, std::span<const float>);
template Var<double> mse_loss(Var<double>, Var<double>, std::span<const double>);
template Var<float> l1_loss(Var<float>, Var<float>, std::span<const float>);
template Var<double> l1_loss(Var<double>, Var<double>, std::span<const double>);
template Var<float> huber_loss(Var<float>, Var<float>, double, std::span<const float>);
template Var<double> huber_loss(Var<double>, Var<double>, double, std::span<const double>);
template Var<float> bce_with_logits(Var<float>, std::span<const float>, std::span<const float>);
template Var<double> bce_with_logits(Var<double>, std::span<const double>, std::span<const double>);

}  // namespace fieldmark
