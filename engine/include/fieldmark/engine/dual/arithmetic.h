#pragma once
#include <fieldmark/engine/dual.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/comparison.h>

#include <type_traits>

namespace fieldmark {

// Ops of arithmetic.h, comparison.h and operators.h for Duals, see dual.h. They broadcast and throw like
// those.

/// @{
/// Applies the op of the same name with its tangent. One of the two operands may be a Var.
///   add: a' + b'   sub: a' - b'   mul: a' b + a b'   div: (a' - y b') / b
///   pow: a' b a^(b - 1) + b' y log a   minimum, maximum: the tangent of the chosen one, a' where both are
///   equal
template <class T>
Dual<T> add(const Dual<T>& a, const Dual<T>& b);
template <class T>
Dual<T> sub(const Dual<T>& a, const Dual<T>& b);
template <class T>
Dual<T> mul(const Dual<T>& a, const Dual<T>& b);
template <class T>
Dual<T> div(const Dual<T>& a, const Dual<T>& b);
template <class T>
Dual<T> pow(const Dual<T>& a, const Dual<T>& b);
template <class T>
Dual<T> minimum(const Dual<T>& a, const Dual<T>& b);
template <class T>
Dual<T> maximum(const Dual<T>& a, const Dual<T>& b);
template <class A, class B>
requires detail::MixedDuals<A, B>
auto add(const A& a, const B& b) { return add(detail::as_dual(a), detail::as_dual(b)); }
template <class A, class B>
requires detail::MixedDuals<A, B>
auto sub(const A& a, const B& b) { return sub(detail::as_dual(a), detail::as_dual(b)); }
template <class A, class B>
requires detail::MixedDuals<A, B>
auto mul(const A& a, const B& b) { return mul(detail::as_dual(a), detail::as_dual(b)); }
template <class A, class B>
requires detail::MixedDuals<A, B>
auto div(const A& a, const B& b) { return div(detail::as_dual(a), detail::as_dual(b)); }
template <class A, class B>
requires detail::MixedDuals<A, B>
auto pow(const A& a, const B& b) { return pow(detail::as_dual(a), detail::as_dual(b)); }
template <class A, class B>
requires detail::MixedDuals<A, B>
auto minimum(const A& a, const B& b) { return minimum(detail::as_dual(a), detail::as_dual(b)); }
template <class A, class B>
requires detail::MixedDuals<A, B>
auto maximum(const A& a, const B& b) { return maximum(detail::as_dual(a), detail::as_dual(b)); }
/// @}

/// Multiplies every element by a constant; the tangent is factor x'.
template <class T>
Dual<T> scale(const Dual<T>& x, double factor);

/// @{
/// Compares the values; the result is a constant without tangent.
template <class A, class B>
requires detail::AnyDual<A, B>
auto greater(const A& a, const B& b) { return greater(detail::value_of(a), detail::value_of(b)); }
template <class A, class B>
requires detail::AnyDual<A, B>
auto less(const A& a, const B& b) { return less(detail::value_of(a), detail::value_of(b)); }
template <class A, class B>
requires detail::AnyDual<A, B>
auto equal(const A& a, const B& b) { return equal(detail::value_of(a), detail::value_of(b)); }
/// @}

/// @{
/// Chooses values and tangents element by element; one of a and b may be a Var.
template <class T>
Dual<T> where(std::type_identity_t<Var<T>> mask, const Dual<T>& a, const Dual<T>& b);
template <class T, class A, class B>
requires detail::MixedDuals<A, B>
auto where(Var<T> mask, const A& a, const B& b) {
  return where(mask, detail::as_dual(a), detail::as_dual(b));
}
/// @}

}  // namespace fieldmark
