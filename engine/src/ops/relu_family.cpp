#include <fieldmark/engine/ops/relu_family.h>

#include <cmath>
#include <numbers>

#include "ops/elementwise.h"

namespace fieldmark {
namespace {

// 1 / (1 + e^-x) by e^-|x|, so that nothing overflows and the small tail keeps its relative accuracy.
template <class T>
T logistic(T x) {
  const T e = std::exp(-std::abs(x));
  return (x < 0 ? e : T(1)) / (1 + e);
}

// (1 + erf(x / sqrt 2)) / 2; by erfc, which does not cancel far below 0.
template <class T>
T normal_cdf(T x) {
  return std::erfc(-x / std::numbers::sqrt2_v<T>) / 2;
}

// y = f(x), dx = dy slope(x), functions of one element.
template <class T, class F, class D>
Var<T> each(Var<T> x, F f, D slope, std::source_location from = std::source_location::current()) {
  return detail::elementwise(
      x, [f](const auto& v) { return v.unaryExpr(f); },
      [slope](const auto& v, const auto&, const auto& dy) { return dy * v.unaryExpr(slope); }, from);
}

}  // namespace

template <class T>
Var<T> leaky_relu(Var<T> x, double slope) {
  const T s = static_cast<T>(slope);
  return each(
      x, [s](T v) { return v > 0 ? v : s * v; }, [s](T v) { return v > 0 ? T(1) : s; });
}

template <class T>
Var<T> elu(Var<T> x, double alpha) {
  const T a = static_cast<T>(alpha);
  return each(
      x, [a](T v) { return v > 0 ? v : a * std::expm1(v); },
      [a](T v) { return v > 0 ? T(1) : a * std::exp(v); });
}

template <class T>
Var<T> silu(Var<T> x) {
  return each(
      x, [](T v) { return v * logistic(v); }, [](T v) { return logistic(v) * (1 + v * logistic(-v)); });
}

template <class T>
Var<T> gelu(Var<T> x) {
  constexpr T kDensity = std::numbers::inv_sqrtpi_v<T> / std::numbers::sqrt2_v<T>;
  return each(
      x, [](T v) { return v * normal_cdf(v); },
      [](T v) { return normal_cdf(v) + v * kDensity * std::exp(-v * v / 2); });
}

template Var<float> leaky_relu(Var<float>, double);
template Var<double> leaky_relu(Var<double>, double);
template Var<float> elu(Var<float>, double);
template Var<double> elu(Var<double>, double);
template Var<float> silu(Var<float>);
template Var<double> silu(Var<double>);
template Var<float> gelu(Var<float>);
template Var<double> gelu(Var<double>);

}  // namespace fieldmark
