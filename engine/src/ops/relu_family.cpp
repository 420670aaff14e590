#include <fieldmark/engine/ops/relu_family.h>

#include <cmath>
#include <numbers>

#include "kernels/gelu.h"
#include "ops/elementwise.h"

namespace fieldmark {
namespace kernels {
namespace {

// dx = dy (P(x) + x p(x)) with the normal distribution P and its density p. A chunk owns its elements.
template <class T>
Var<T> gelu(Var<T> x, std::source_location from = std::source_location::current()) {
  const auto forward = FIELDMARK_KERNEL(gelu_forward<T>);
  T* y = nullptr;
  const Var<T> out = x.tape().output(x.shape(), &y, {x}, from);
  parallel_for(x.shape().size(), detail::kGrain,
               [&](Index begin, Index end) { forward(x.value() + begin, y + begin, end - begin); });
  x.tape().on_backward(out, [x](const T* dy) {
    const auto backward = FIELDMARK_KERNEL(gelu_backward<T>);
    bool fresh = false;
    T* dx = x.grad_acc(&fresh);
    parallel_for(x.shape().size(), detail::kGrain, [&](Index begin, Index end) {
      backward(x.value() + begin, dy + begin, dx + begin, !fresh, end - begin);
    });
  });
  return out;
}

}  // namespace
}  // namespace kernels

namespace {

// 1 / (1 + e^-x), from e^-|x| so that nothing overflows and the small tail keeps its relative accuracy.
template <class T>
T logistic(T x) {
  const T e = std::exp(-std::abs(x));
  return (x < 0 ? e : T(1)) / (1 + e);
}

// (1 + erf(x / sqrt 2)) / 2, from erfc, which does not cancel far below 0.
template <class T>
T cdf(T x) {
  return std::erfc(-x / std::numbers::sqrt2_v<T>) / 2;
}

template <class T>
T cdf_slope(T x) {
  return std::numbers::inv_sqrtpi_v<T> / std::numbers::sqrt2_v<T> * std::exp(-x * x / 2);
}

// y = f(x), dx = dy slope(x) for elementwise functions.
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
  return kernels::gelu(x);
}

template <class T>
Var<T> normal_cdf(Var<T> x) {
  return each(
      x, [](T v) { return cdf(v); }, [](T v) { return cdf_slope(v); });
}

template Var<float> leaky_relu(Var<float>, double);
template Var<double> leaky_relu(Var<double>, double);
template Var<float> elu(Var<float>, double);
template Var<double> elu(Var<double>, double);
template Var<float> silu(Var<float>);
template Var<double> silu(Var<double>);
template Var<float> gelu(Var<float>);
template Var<double> gelu(Var<double>);
template Var<float> normal_cdf(Var<float>);
template Var<double> normal_cdf(Var<double>);

}  // namespace fieldmark
