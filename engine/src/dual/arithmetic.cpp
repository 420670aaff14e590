#include <fieldmark/engine/dual/arithmetic.h>
#include <fieldmark/engine/ops/math.h>
#include <fieldmark/engine/ops/operators.h>

#include "dual/tangent.h"

namespace fieldmark {

using detail::tangent_by;
using detail::with_tangent;

namespace {

// Returns y with the tangent of a where the mask holds and of b elsewhere.
template <class T>
Dual<T> chosen(Var<T> y, Var<T> mask, const Dual<T>& a, const Dual<T>& b) {
  if (!a.has_tangent() && !b.has_tangent()) return y;
  return {y, broadcast_to(where(mask, a.tangent(), b.tangent()), y.shape())};
}

}  // namespace

template <class T>
Dual<T> add(const Dual<T>& a, const Dual<T>& b) {
  const auto same = [](Var<T> t) { return t; };
  return with_tangent(add(a.value(), b.value()), detail::plus<T>(tangent_by(a, same), tangent_by(b, same)));
}

template <class T>
Dual<T> sub(const Dual<T>& a, const Dual<T>& b) {
  const Var<T> y = sub(a.value(), b.value());
  if (a.has_tangent() && b.has_tangent()) return {y, sub(a.tangent(), b.tangent())};
  return with_tangent(y, a.has_tangent() ? detail::Tangent<T>(a.tangent())
                                         : tangent_by(b, [](Var<T> t) { return negate(t); }));
}

template <class T>
Dual<T> mul(const Dual<T>& a, const Dual<T>& b) {
  return with_tangent(mul(a.value(), b.value()),
                      detail::plus<T>(tangent_by(a, [&](Var<T> t) { return t * b.value(); }),
                                      tangent_by(b, [&](Var<T> t) { return a.value() * t; })));
}

template <class T>
Dual<T> div(const Dual<T>& a, const Dual<T>& b) {
  const Var<T> y = div(a.value(), b.value());
  const auto sum = detail::plus<T>(tangent_by(a, [](Var<T> t) { return t; }),
                                   tangent_by(b, [&](Var<T> t) { return -(y * t); }));
  return with_tangent<T>(y, sum ? detail::Tangent<T>(*sum / b.value()) : sum);
}

// Replaces a base of 0 by 1 where its term is 0 anyway: 0^-1 and log 0 are infinite, and 0 times infinity is
// NaN.
template <class T>
Dual<T> pow(const Dual<T>& a, const Dual<T>& b) {
  const Var<T> x = a.value(), p = b.value(), y = pow(x, p);
  const Var<T> zero = detail::filled(x.tape(), Shape{1}, 0), one = detail::filled(x.tape(), Shape{1}, 1);
  const auto of_base = [&](Var<T> t) {
    const Var<T> base = where(equal(x, zero) * equal(p, zero), one, x);
    return t * (p * pow(base, p - T(1)));
  };
  const auto of_power = [&](Var<T> t) { return t * (y * log(where(equal(x, zero), one, x))); };
  return with_tangent(y, detail::plus<T>(tangent_by(a, of_base), tangent_by(b, of_power)));
}

template <class T>
Dual<T> minimum(const Dual<T>& a, const Dual<T>& b) {
  return chosen(minimum(a.value(), b.value()), greater(a, b), b, a);
}

template <class T>
Dual<T> maximum(const Dual<T>& a, const Dual<T>& b) {
  return chosen(maximum(a.value(), b.value()), less(a, b), b, a);
}

template <class T>
Dual<T> scale(const Dual<T>& x, double factor) {
  return detail::linear(x, [=](Var<T> v) { return scale(v, factor); });
}

template <class T>
Dual<T> where(std::type_identity_t<Var<T>> mask, const Dual<T>& a, const Dual<T>& b) {
  return chosen(where(mask, a.value(), b.value()), mask, a, b);
}

#define FIELDMARK_DUAL_BINARY(f)                                  \
  template Dual<float> f(const Dual<float>&, const Dual<float>&); \
  template Dual<double> f(const Dual<double>&, const Dual<double>&);
FIELDMARK_DUAL_BINARY(add)
FIELDMARK_DUAL_BINARY(sub)
FIELDMARK_DUAL_BINARY(mul)
FIELDMARK_DUAL_BINARY(div)
FIELDMARK_DUAL_BINARY(pow)
FIELDMARK_DUAL_BINARY(minimum)
FIELDMARK_DUAL_BINARY(maximum)
#undef FIELDMARK_DUAL_BINARY
template Dual<float> scale(const Dual<float>&, double);
template Dual<double> scale(const Dual<double>&, double);
template Dual<float> where(Var<float>, const Dual<float>&, const Dual<float>&);
template Dual<double> where(Var<double>, const Dual<double>&, const Dual<double>&);

}  // namespace fieldmark
