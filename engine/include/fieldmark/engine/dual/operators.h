#pragma once
#include <fieldmark/engine/dual/arithmetic.h>
#include <fieldmark/engine/dual/math.h>
#include <fieldmark/engine/ops/fused.h>
#include <fieldmark/engine/ops/operators.h>

namespace fieldmark {

// Operators for Duals, as in a * b + 1.0f; see ops/operators.h.

/// @{
/// Applies the corresponding op; one of the two operands may be a Var.
template <class A, class B>
requires detail::AnyDual<A, B>
auto operator+(const A& a, const B& b) { return add(a, b); }
template <class A, class B>
requires detail::AnyDual<A, B>
auto operator-(const A& a, const B& b) { return sub(a, b); }
template <class A, class B>
requires detail::AnyDual<A, B>
auto operator*(const A& a, const B& b) { return mul(a, b); }
template <class A, class B>
requires detail::AnyDual<A, B>
auto operator/(const A& a, const B& b) { return div(a, b); }
template <class T>
Dual<T> operator-(const Dual<T>& a) {
  return negate(a);
}
/// @}

/// @{
/// Combines every element with a number.
template <class T>
Dual<T> operator+(const Dual<T>& a, std::type_identity_t<T> number) {
  return affine(a, 1, static_cast<double>(number));
}
template <class T>
Dual<T> operator+(std::type_identity_t<T> number, const Dual<T>& a) {
  return affine(a, 1, static_cast<double>(number));
}
template <class T>
Dual<T> operator-(const Dual<T>& a, std::type_identity_t<T> number) {
  return affine(a, 1, -static_cast<double>(number));
}
template <class T>
Dual<T> operator-(std::type_identity_t<T> number, const Dual<T>& a) {
  return affine(a, -1, static_cast<double>(number));
}
template <class T>
Dual<T> operator*(const Dual<T>& a, std::type_identity_t<T> number) {
  return scale(a, static_cast<double>(number));
}
template <class T>
Dual<T> operator*(std::type_identity_t<T> number, const Dual<T>& a) {
  return scale(a, static_cast<double>(number));
}
template <class T>
Dual<T> operator/(const Dual<T>& a, std::type_identity_t<T> number) {
  return div(a, static_cast<double>(number));
}
template <class T>
Dual<T> operator/(std::type_identity_t<T> number, const Dual<T>& a) {
  return scale(reciprocal(a), static_cast<double>(number));
}
/// @}

/// Applies f to Duals op by op, see ops/fused.h.
template <class F, class First, class... Rest>
requires detail::AnyDual<First, Rest...>
auto fused(F f, const First& first, const Rest&... rest) { return f(first, rest...); }

}  // namespace fieldmark
