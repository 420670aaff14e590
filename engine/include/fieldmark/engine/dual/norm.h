#pragma once
#include <fieldmark/engine/dual.h>
#include <fieldmark/engine/ops/batch_norm.h>
#include <fieldmark/engine/ops/group_norm.h>
#include <fieldmark/engine/ops/layer_norm.h>

#include <span>
#include <type_traits>

namespace fieldmark {

/// @{
/// Applies the norm of layer_norm.h, group_norm.h or batch_norm.h with its tangent; some operands may be
/// Vars. With n = (x - mean) / s and s = sqrt(var + eps),
///   y' = gamma' n + gamma n' + beta',   n' = (c - n mean(n c)) / s,   c = x' - mean(x')
/// and n' = x' / s for fixed statistics. With relu, y' is 0 where y is.
template <class T>
Dual<T> layer_norm(const Dual<T>& x, const Dual<T>& gamma, const Dual<T>& beta, double eps = 1e-5);
template <class T>
Dual<T> group_norm(const Dual<T>& x, const Dual<T>& gamma, const Dual<T>& beta,
                   const GroupNormOptions& options = {});
template <class T>
Dual<T> batch_norm(const Dual<T>& x, const Dual<T>& gamma, const Dual<T>& beta,
                   const BatchNormOptions& options = {}, BatchStatistics* statistics = nullptr);
template <class T>
Dual<T> batch_norm_fixed(const Dual<T>& x, const Dual<T>& gamma, const Dual<T>& beta,
                         std::span<const std::type_identity_t<T>> mean,
                         std::span<const std::type_identity_t<T>> variance,
                         const BatchNormOptions& options = {});
template <class A, class B, class C>
requires detail::MixedDuals<A, B, C>
auto layer_norm(const A& x, const B& gamma, const C& beta, double eps = 1e-5) {
  return layer_norm(detail::as_dual(x), detail::as_dual(gamma), detail::as_dual(beta), eps);
}
template <class A, class B, class C>
requires detail::MixedDuals<A, B, C>
auto group_norm(const A& x, const B& gamma, const C& beta, const GroupNormOptions& options = {}) {
  return group_norm(detail::as_dual(x), detail::as_dual(gamma), detail::as_dual(beta), options);
}
template <class A, class B, class C>
requires detail::MixedDuals<A, B, C>
auto batch_norm(const A& x, const B& gamma, const C& beta, const BatchNormOptions& options = {},
                BatchStatistics* statistics = nullptr) {
  return batch_norm(detail::as_dual(x), detail::as_dual(gamma), detail::as_dual(beta), options, statistics);
}
template <class A, class B, class C>
requires detail::MixedDuals<A, B, C>
auto batch_norm_fixed(const A& x, const B& gamma, const C& beta,
                      std::span<const typename detail::DualOperand<A>::Scalar> mean,
                      std::span<const typename detail::DualOperand<A>::Scalar> variance,
                      const BatchNormOptions& options = {}) {
  return batch_norm_fixed(detail::as_dual(x), detail::as_dual(gamma), detail::as_dual(beta), mean, variance,
                          options);
}
/// @}

}  // namespace fieldmark
