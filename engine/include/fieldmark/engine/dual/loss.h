#pragma once
#include <fieldmark/engine/dual.h>
#include <fieldmark/engine/ops/feature_distance.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/softmax.h>

#include <cstdint>
#include <span>
#include <type_traits>

namespace fieldmark {

// Losses for Duals. Weights and targets are constants; keep them alive for the pass, since some losses refer
// to them.

/// @{
/// Computes the loss of loss.h with its tangent; one of a and b may be a Var. With d = a - b:
///   mse_loss: mean 2 d d'   l1_loss: mean sign(d) d'   huber_loss: mean clamp(d, -delta, delta) d'
template <class T>
Dual<T> mse_loss(const Dual<T>& a, const Dual<T>& b, std::span<const std::type_identity_t<T>> weights = {});
template <class T>
Dual<T> l1_loss(const Dual<T>& a, const Dual<T>& b, std::span<const std::type_identity_t<T>> weights = {});
template <class T>
Dual<T> huber_loss(const Dual<T>& a, const Dual<T>& b, double delta,
                   std::span<const std::type_identity_t<T>> weights = {});
template <class A, class B>
requires detail::MixedDuals<A, B>
auto mse_loss(const A& a, const B& b, std::span<const typename detail::DualOperand<A>::Scalar> weights = {}) {
  return mse_loss(detail::as_dual(a), detail::as_dual(b), weights);
}
template <class A, class B>
requires detail::MixedDuals<A, B>
auto l1_loss(const A& a, const B& b, std::span<const typename detail::DualOperand<A>::Scalar> weights = {}) {
  return l1_loss(detail::as_dual(a), detail::as_dual(b), weights);
}
template <class A, class B>
requires detail::MixedDuals<A, B>
auto huber_loss(const A& a, const B& b, double delta,
                std::span<const typename detail::DualOperand<A>::Scalar> weights = {}) {
  return huber_loss(detail::as_dual(a), detail::as_dual(b), delta, weights);
}
/// @}

/// @{
/// Computes the cross-entropy of loss.h or softmax.h with its tangent.
///   bce_with_logits: mean (s(x) - t) x'   softmax_cross_entropy: mean over rows of sum (softmax(x) -
///   1_label) x'
template <class T>
Dual<T> bce_with_logits(const Dual<T>& logits, std::span<const std::type_identity_t<T>> targets,
                        std::span<const std::type_identity_t<T>> weights = {});
template <class T>
Dual<T> softmax_cross_entropy(const Dual<T>& logits, std::span<const std::int32_t> labels,
                              std::span<const std::type_identity_t<T>> weights = {});
/// @}

/// @{
/// Computes the distance of feature_distance.h with its tangent; one of a and b may be a Var.
///   mean_p sum_c 2 w_c d d',   d the difference of the scaled features; 0 from a pixel whose features are
///   all 0
template <class T>
Dual<T> feature_distance(const Dual<T>& a, const Dual<T>& b,
                         std::span<const std::type_identity_t<T>> weights);
template <class A, class B>
requires detail::MixedDuals<A, B>
auto feature_distance(const A& a, const B& b,
                      std::span<const typename detail::DualOperand<A>::Scalar> weights) {
  return feature_distance(detail::as_dual(a), detail::as_dual(b), weights);
}
/// @}

}  // namespace fieldmark
