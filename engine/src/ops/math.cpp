#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/ops/math.h>

#include <cmath>
#include <string>

#include "ops/elementwise.h"

namespace fieldmark {
// Each backward is dx = dy f'(x), with f' in terms of x or y, whichever is exact.

template <class T>
Var<T> negate(Var<T> x) {
  return detail::elementwise(
      x, [](const auto& v) { return -v; }, [](const auto&, const auto&, const auto& dy) { return -dy; });
}

template <class T>
Var<T> affine(Var<T> x, double factor, double offset) {
  const T f = static_cast<T>(factor), o = static_cast<T>(offset);
  return detail::elementwise(
      x, [f, o](const auto& v) { return f * v + o; },
      [f](const auto&, const auto&, const auto& dy) { return f * dy; });
}

template <class T>
Var<T> div(Var<T> x, double divisor) {
  if (divisor == 0) throw ValueError("[div] divisor must not be 0");
  const T d = static_cast<T>(divisor);
  return detail::elementwise(
      x, [d](const auto& v) { return v / d; },
      [d](const auto&, const auto&, const auto& dy) { return dy / d; });
}

template <class T>
Var<T> reciprocal(Var<T> x) {
  return detail::elementwise(
      x, [](const auto& v) { return T(1) / v; },
      [](const auto&, const auto& y, const auto& dy) { return -dy * y * y; });
}

template <class T>
Var<T> abs(Var<T> x) {
  return detail::elementwise(
      x, [](const auto& v) { return v.abs(); },
      [](const auto& v, const auto&, const auto& dy) {
        return (v < T(0)).select(-dy, (v > T(0)).select(dy, T(0)));
      });
}

template <class T>
Var<T> square(Var<T> x) {
  return detail::elementwise(
      x, [](const auto& v) { return v * v; },
      [](const auto& v, const auto&, const auto& dy) { return T(2) * dy * v; });
}

// Eigen's sqrt() of floats refines an approximation that differs between makes of CPU, to 2 ulp.
template <class T>
Var<T> sqrt(Var<T> x) {
  return detail::elementwise(
      x, [](const auto& v) { return v.unaryExpr([](T a) { return std::sqrt(a); }); },
      [](const auto&, const auto& y, const auto& dy) { return T(0.5) * dy / y; });
}

template <class T>
Var<T> pow(Var<T> x, double p) {
  const T power = static_cast<T>(p);
  return detail::elementwise(
      x, [power](const auto& v) { return v.unaryExpr([power](T a) { return std::pow(a, power); }); },
      [power](const auto& v, const auto&, const auto& dy) {
        const auto slope = [power](T a) { return power == 0 ? T(0) : power * std::pow(a, power - 1); };
        return dy * v.unaryExpr(slope);
      });
}

template <class T>
Var<T> log(Var<T> x) {
  return detail::elementwise(
      // Eigen's log of vectors takes subnormal numbers for the smallest normal one.
      x, [](const auto& v) { return v.unaryExpr([](T a) { return std::log(a); }); },
      [](const auto& v, const auto&, const auto& dy) { return dy / v; });
}

template <class T>
Var<T> log1p(Var<T> x) {
  return detail::elementwise(
      x, [](const auto& v) { return v.unaryExpr([](T a) { return std::log1p(a); }); },
      [](const auto& v, const auto&, const auto& dy) { return dy / (T(1) + v); });
}

template <class T>
Var<T> expm1(Var<T> x) {
  return detail::elementwise(
      x, [](const auto& v) { return v.unaryExpr([](T a) { return std::expm1(a); }); },
      [](const auto&, const auto& y, const auto& dy) { return dy * (y + T(1)); });
}

template <class T>
Var<T> sin(Var<T> x) {
  return detail::elementwise(
      x, [](const auto& v) { return v.sin(); },
      [](const auto& v, const auto&, const auto& dy) { return dy * v.cos(); });
}

template <class T>
Var<T> cos(Var<T> x) {
  return detail::elementwise(
      x, [](const auto& v) { return v.cos(); },
      [](const auto& v, const auto&, const auto& dy) { return -dy * v.sin(); });
}

template <class T>
Var<T> clamp(Var<T> x, double low, double high) {
  if (!(low <= high))
    throw ValueError("[clamp] low must be at most high, got " + number_text(low) + " and " +
                     number_text(high));
  const T lo = static_cast<T>(low), hi = static_cast<T>(high);
  return detail::elementwise(
      x, [lo, hi](const auto& v) { return (v < lo).select(lo, (v > hi).select(hi, v)); },
      [lo, hi](const auto& v, const auto&, const auto& dy) { return (v < lo || v > hi).select(T(0), dy); });
}

#define FIELDMARK_UNARY(f)           \
  template Var<float> f(Var<float>); \
  template Var<double> f(Var<double>);
FIELDMARK_UNARY(negate)
FIELDMARK_UNARY(reciprocal)
FIELDMARK_UNARY(abs)
FIELDMARK_UNARY(square)
FIELDMARK_UNARY(sqrt)
FIELDMARK_UNARY(log)
FIELDMARK_UNARY(log1p)
FIELDMARK_UNARY(expm1)
FIELDMARK_UNARY(sin)
FIELDMARK_UNARY(cos)
#undef FIELDMARK_UNARY
template Var<float> affine(Var<float>, double, double);
template Var<double> affine(Var<double>, double, double);
template Var<float> div(Var<float>, double);
template Var<double> div(Var<double>, double);
template Var<float> pow(Var<float>, double);
template Var<double> pow(Var<double>, double);
template Var<float> clamp(Var<float>, double, double);
template Var<double> clamp(Var<double>, double, double);

}  // namespace fieldmark
