#pragma once
#include <fieldmark/engine/dual.h>
#include <fieldmark/engine/ops/batched_matmul.h>
#include <fieldmark/engine/ops/cholesky.h>
#include <fieldmark/engine/ops/conv2d.h>
#include <fieldmark/engine/ops/dense.h>
#include <fieldmark/engine/ops/determinant.h>
#include <fieldmark/engine/ops/linear_solve.h>
#include <fieldmark/engine/ops/matmul.h>

namespace fieldmark {

/// @{
/// Computes the product of matmul.h or batched_matmul.h with its tangent a' b + a b'. One of a and b may be a
/// Var.
template <class T>
Dual<T> matmul(const Dual<T>& a, const Dual<T>& b);
template <class T>
Dual<T> batched_matmul(const Dual<T>& a, const Dual<T>& b);
template <class A, class B>
requires detail::MixedDuals<A, B>
auto matmul(const A& a, const B& b) { return matmul(detail::as_dual(a), detail::as_dual(b)); }
template <class A, class B>
requires detail::MixedDuals<A, B>
auto batched_matmul(const A& a, const B& b) { return batched_matmul(detail::as_dual(a), detail::as_dual(b)); }
/// @}

/// @{
/// Applies the layer of dense.h or conv2d.h with its tangent; some operands may be Vars. Products are linear
/// in x and in w: y' = x' w + x w' + b', 0 where a ReLU is inactive.
template <class T>
Dual<T> dense(const Dual<T>& x, const Dual<T>& w, const Dual<T>& b, Activation activation = Activation::none);
template <class T>
Dual<T> conv2d(const Dual<T>& x, const Dual<T>& w, const Dual<T>& b, Activation activation = Activation::none,
               ConvMethod method = ConvMethod::fastest);
template <class T>
Dual<T> conv2d(const Dual<T>& x, const Dual<T>& w, const Dual<T>& b, ConvWindow steps,
               Activation activation = Activation::none);
template <class A, class B, class C>
requires detail::MixedDuals<A, B, C>
auto dense(const A& x, const B& w, const C& b, Activation activation = Activation::none) {
  return dense(detail::as_dual(x), detail::as_dual(w), detail::as_dual(b), activation);
}
template <class A, class B, class C>
requires detail::MixedDuals<A, B, C>
auto conv2d(const A& x, const B& w, const C& b, Activation activation = Activation::none,
            ConvMethod method = ConvMethod::fastest) {
  return conv2d(detail::as_dual(x), detail::as_dual(w), detail::as_dual(b), activation, method);
}
template <class A, class B, class C>
requires detail::MixedDuals<A, B, C>
auto conv2d(const A& x, const B& w, const C& b, ConvWindow steps, Activation activation = Activation::none) {
  return conv2d(detail::as_dual(x), detail::as_dual(w), detail::as_dual(b), steps, activation);
}
/// @}

/// @{
/// Applies the op of linear_solve.h with its tangent; one of the two operands may be a Var.
///   triangular_solve: T^-1 (b' - T' x)   solve: a^-1 (b' - a' x)   inverse: -y a' y
template <class T>
Dual<T> triangular_solve(const Dual<T>& a, const Dual<T>& b, Triangle triangle = {});
template <class T>
Dual<T> solve(const Dual<T>& a, const Dual<T>& b);
template <class T>
Dual<T> inverse(const Dual<T>& a);
template <class A, class B>
requires detail::MixedDuals<A, B>
auto triangular_solve(const A& a, const B& b, Triangle triangle = {}) {
  return triangular_solve(detail::as_dual(a), detail::as_dual(b), triangle);
}
template <class A, class B>
requires detail::MixedDuals<A, B>
auto solve(const A& a, const B& b) { return solve(detail::as_dual(a), detail::as_dual(b)); }
/// @}

/// Computes the factor of cholesky.h with its tangent.
///   L' = L P(L^-1 (a' + a'^T) / 2 L^-T),   P: the lower triangle with half of the diagonal
/// Source: Murray 2016, eq. 8.
template <class T>
Dual<T> cholesky(const Dual<T>& a);

/// Computes the determinant of determinant.h with its tangent y tr(a^-1 a').
/// @throws ValueError if a matrix is singular and has a tangent
template <class T>
Dual<T> determinant(const Dual<T>& a);

/// Computes the logarithm of determinant.h with its tangent tr(a^-1 a').
template <class T>
Dual<T> log_determinant(const Dual<T>& a);

}  // namespace fieldmark
