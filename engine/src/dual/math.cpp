#include <fieldmark/engine/dual/math.h>
#include <fieldmark/engine/ops/operators.h>

#include <numbers>

#include "dual/tangent.h"

namespace fieldmark {

using detail::linear;
using detail::with_tangent;

namespace {

template <class T>
Var<T> zero_of(const Dual<T>& x) {
  return detail::filled(x.tape(), Shape{1}, 0);
}

}  // namespace

template <class T>
Dual<T> negate(const Dual<T>& x) {
  return linear(x, [](Var<T> v) { return negate(v); });
}

template <class T>
Dual<T> affine(const Dual<T>& x, double factor, double offset) {
  return with_tangent(affine(x.value(), factor, offset), x, [=](Var<T> t) { return scale(t, factor); });
}

template <class T>
Dual<T> div(const Dual<T>& x, double divisor) {
  return linear(x, [=](Var<T> v) { return div(v, divisor); });
}

template <class T>
Dual<T> reciprocal(const Dual<T>& x) {
  const Var<T> y = reciprocal(x.value());
  return with_tangent(y, x, [=](Var<T> t) { return -(t * square(y)); });
}

template <class T>
Dual<T> abs(const Dual<T>& x) {
  return with_tangent(abs(x.value()), x, [&](Var<T> t) {
    return where(less(x.value(), zero_of(x)), -t, detail::only(greater(x.value(), zero_of(x)), t));
  });
}

template <class T>
Dual<T> square(const Dual<T>& x) {
  return with_tangent(square(x.value()), x, [&](Var<T> t) { return T(2) * (x.value() * t); });
}

template <class T>
Dual<T> sqrt(const Dual<T>& x) {
  const Var<T> y = sqrt(x.value());
  return with_tangent(y, x, [=](Var<T> t) { return T(0.5) * (t / y); });
}

template <class T>
Dual<T> pow(const Dual<T>& x, double p) {
  const Var<T> y = pow(x.value(), p);
  if (p == 0) return y;
  return with_tangent(y, x, [&](Var<T> t) { return scale(t * pow(x.value(), p - 1), p); });
}

template <class T>
Dual<T> log(const Dual<T>& x) {
  return with_tangent(log(x.value()), x, [&](Var<T> t) { return t / x.value(); });
}

template <class T>
Dual<T> log1p(const Dual<T>& x) {
  return with_tangent(log1p(x.value()), x, [&](Var<T> t) { return t / (x.value() + T(1)); });
}

template <class T>
Dual<T> expm1(const Dual<T>& x) {
  const Var<T> y = expm1(x.value());
  return with_tangent(y, x, [=](Var<T> t) { return t * (y + T(1)); });
}

template <class T>
Dual<T> sin(const Dual<T>& x) {
  return with_tangent(sin(x.value()), x, [&](Var<T> t) { return t * cos(x.value()); });
}

template <class T>
Dual<T> cos(const Dual<T>& x) {
  return with_tangent(cos(x.value()), x, [&](Var<T> t) { return -(t * sin(x.value())); });
}

template <class T>
Dual<T> clamp(const Dual<T>& x, double low, double high) {
  return with_tangent(clamp(x.value(), low, high), x, [&](Var<T> t) {
    const Var<T> v = x.value();
    const auto bound = [&](double b) { return detail::filled(x.tape(), Shape{1}, b); };
    return detail::except(less(v, bound(low)), detail::except(greater(v, bound(high)), t));
  });
}

template <class T>
Dual<T> relu(const Dual<T>& x) {
  return with_tangent(relu(x.value()), x,
                      [&](Var<T> t) { return detail::only(greater(x.value(), zero_of(x)), t); });
}

template <class T>
Dual<T> sigmoid(const Dual<T>& x) {
  const Var<T> y = sigmoid(x.value());
  return with_tangent(y, x, [=](Var<T> t) { return t * (y * (T(1) - y)); });
}

template <class T>
Dual<T> tanh(const Dual<T>& x) {
  const Var<T> y = tanh(x.value());
  return with_tangent(y, x, [=](Var<T> t) { return t * (T(1) - square(y)); });
}

template <class T>
Dual<T> exp(const Dual<T>& x) {
  const Var<T> y = exp(x.value());
  return with_tangent(y, x, [=](Var<T> t) { return t * y; });
}

template <class T>
Dual<T> truncated_exp(const Dual<T>& x) {
  const Var<T> y = truncated_exp(x.value());
  return with_tangent(y, x, [=](Var<T> t) { return t * y; });
}

template <class T>
Dual<T> softplus(const Dual<T>& x) {
  return with_tangent(softplus(x.value()), x, [&](Var<T> t) { return t * sigmoid(x.value()); });
}

template <class T>
Dual<T> leaky_relu(const Dual<T>& x, double slope) {
  return with_tangent(leaky_relu(x.value(), slope), x,
                      [&](Var<T> t) { return where(greater(x.value(), zero_of(x)), t, scale(t, slope)); });
}

// The exponential of an element that is not chosen must not overflow: its backward would multiply 0 by
// infinity.
template <class T>
Dual<T> elu(const Dual<T>& x, double alpha) {
  return with_tangent(elu(x.value(), alpha), x, [&](Var<T> t) {
    const Var<T> v = x.value(), e = exp(minimum(v, zero_of(x)));
    return where(greater(v, zero_of(x)), t, scale(t * e, alpha));
  });
}

// 1 - s(x) as s(-x), which does not cancel.
template <class T>
Dual<T> silu(const Dual<T>& x) {
  return with_tangent(silu(x.value()), x, [&](Var<T> t) {
    const Var<T> v = x.value();
    return t * (sigmoid(v) * (v * sigmoid(-v) + T(1)));
  });
}

namespace {

template <class T>
Var<T> normal_density(Var<T> x) {
  return scale(exp(scale(square(x), -0.5)), std::numbers::inv_sqrtpi / std::numbers::sqrt2);
}

}  // namespace

template <class T>
Dual<T> gelu(const Dual<T>& x) {
  return with_tangent(gelu(x.value()), x, [&](Var<T> t) {
    const Var<T> v = x.value();
    return t * (normal_cdf(v) + v * normal_density(v));
  });
}

template <class T>
Dual<T> normal_cdf(const Dual<T>& x) {
  return with_tangent(normal_cdf(x.value()), x, [&](Var<T> t) { return t * normal_density(x.value()); });
}

#define FIELDMARK_DUAL_UNARY(f)               \
  template Dual<float> f(const Dual<float>&); \
  template Dual<double> f(const Dual<double>&);
FIELDMARK_DUAL_UNARY(negate)
FIELDMARK_DUAL_UNARY(reciprocal)
FIELDMARK_DUAL_UNARY(abs)
FIELDMARK_DUAL_UNARY(square)
FIELDMARK_DUAL_UNARY(sqrt)
FIELDMARK_DUAL_UNARY(log)
FIELDMARK_DUAL_UNARY(log1p)
FIELDMARK_DUAL_UNARY(expm1)
FIELDMARK_DUAL_UNARY(sin)
FIELDMARK_DUAL_UNARY(cos)
FIELDMARK_DUAL_UNARY(relu)
FIELDMARK_DUAL_UNARY(sigmoid)
FIELDMARK_DUAL_UNARY(tanh)
FIELDMARK_DUAL_UNARY(exp)
FIELDMARK_DUAL_UNARY(truncated_exp)
FIELDMARK_DUAL_UNARY(softplus)
FIELDMARK_DUAL_UNARY(silu)
FIELDMARK_DUAL_UNARY(gelu)
FIELDMARK_DUAL_UNARY(normal_cdf)
#undef FIELDMARK_DUAL_UNARY
#define FIELDMARK_DUAL_UNARY(T)                            \
  template Dual<T> affine(const Dual<T>&, double, double); \
  template Dual<T> div(const Dual<T>&, double);            \
  template Dual<T> pow(const Dual<T>&, double);            \
  template Dual<T> clamp(const Dual<T>&, double, double);  \
  template Dual<T> leaky_relu(const Dual<T>&, double);     \
  template Dual<T> elu(const Dual<T>&, double);
FIELDMARK_DUAL_UNARY(float)
FIELDMARK_DUAL_UNARY(double)
#undef FIELDMARK_DUAL_UNARY

}  // namespace fieldmark
