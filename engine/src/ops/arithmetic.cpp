#include <fieldmark/engine/ops/arithmetic.h>

#include "ops/broadcast.h"

namespace fieldmark {

// Comments give dy/da and dy/db where they are more than a factor.

template <class T>
Var<T> add(Var<T> a, Var<T> b) {
  return detail::binary(
      "add", a, b, [](const auto& x, const auto& z) { return x + z; },
      [](const auto&, const auto&, const auto& dy) { return dy; },
      [](const auto&, const auto&, const auto& dy) { return dy; });
}

template <class T>
Var<T> sub(Var<T> a, Var<T> b) {
  return detail::binary(
      "sub", a, b, [](const auto& x, const auto& z) { return x - z; },
      [](const auto&, const auto&, const auto& dy) { return dy; },
      [](const auto&, const auto&, const auto& dy) { return -dy; });
}

template <class T>
Var<T> mul(Var<T> a, Var<T> b) {
  return detail::binary(
      "mul", a, b, [](const auto& x, const auto& z) { return x * z; },
      [](const auto&, const auto& z, const auto& dy) { return dy * z; },
      [](const auto& x, const auto&, const auto& dy) { return dy * x; });
}

// 1 / b and -a / b^2, dividing twice so that b^2 cannot overflow.
template <class T>
Var<T> div(Var<T> a, Var<T> b) {
  return detail::binary(
      "div", a, b, [](const auto& x, const auto& z) { return x / z; },
      [](const auto&, const auto& z, const auto& dy) { return dy / z; },
      [](const auto& x, const auto& z, const auto& dy) { return -dy * (x / z) / z; });
}

// b a^(b - 1) and a^b log a, whose limits are 0 where one factor is 0 and the other infinite.
template <class T>
Var<T> pow(Var<T> a, Var<T> b) {
  return detail::binary(
      "pow", a, b, [](const auto& x, const auto& z) { return Eigen::pow(x, z); },
      [](const auto& x, const auto& z, const auto& dy) {
        return (z == T(0)).select(T(0), dy * z * Eigen::pow(x, z - T(1)));
      },
      [](const auto& x, const auto& z, const auto& dy) {
        return (x == T(0) && z >= T(0)).select(T(0), dy * Eigen::pow(x, z) * x.unaryExpr([](T v) {
          return std::log(v);
        }));
      });
}

// A comparison with NaN is false; the sum then makes the result NaN.
template <class T>
Var<T> minimum(Var<T> a, Var<T> b) {
  const auto smaller = [](T x, T z) { return x <= z ? x : z < x ? z : x + z; };
  return detail::binary(
      "minimum", a, b, [=](const auto& x, const auto& z) { return x.binaryExpr(z, smaller); },
      [](const auto& x, const auto& z, const auto& dy) { return (z < x).select(T(0), dy); },
      [](const auto& x, const auto& z, const auto& dy) { return (z < x).select(dy, T(0)); });
}

template <class T>
Var<T> maximum(Var<T> a, Var<T> b) {
  const auto larger = [](T x, T z) { return x >= z ? x : z > x ? z : x + z; };
  return detail::binary(
      "maximum", a, b, [=](const auto& x, const auto& z) { return x.binaryExpr(z, larger); },
      [](const auto& x, const auto& z, const auto& dy) { return (z > x).select(T(0), dy); },
      [](const auto& x, const auto& z, const auto& dy) { return (z > x).select(dy, T(0)); });
}

template <class T>
Var<T> scale(Var<T> x, double factor) {
  const T f = static_cast<T>(factor);
  return detail::elementwise(
      x, [f](const auto& v) { return f * v; },
      [f](const auto&, const auto&, const auto& dy) { return f * dy; });
}

#define FIELDMARK_BINARY(f)                      \
  template Var<float> f(Var<float>, Var<float>); \
  template Var<double> f(Var<double>, Var<double>);
FIELDMARK_BINARY(add)
FIELDMARK_BINARY(sub)
FIELDMARK_BINARY(mul)
FIELDMARK_BINARY(div)
FIELDMARK_BINARY(pow)
FIELDMARK_BINARY(minimum)
FIELDMARK_BINARY(maximum)
template Var<float> scale(Var<float>, double);
template Var<double> scale(Var<double>, double);
#undef FIELDMARK_BINARY

}  // namespace fieldmark
