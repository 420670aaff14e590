#include <fieldmark/engine/dual/arithmetic.h>
#include <fieldmark/engine/dual/loss.h>
#include <fieldmark/engine/dual/math.h>
#include <fieldmark/engine/dual/operators.h>
#include <fieldmark/engine/dual/reduce.h>

#include "dual/tangent.h"

namespace fieldmark {
namespace {

// Gives a loss y = sum_i w_i l(d_i) / sum_i w_i, d = a - b, its tangent from the slope l'(d).
template <class T, class F>
Dual<T> of_difference(Var<T> y, const Dual<T>& a, const Dual<T>& b, std::span<const T> weights, F slope) {
  const Dual<T> d = sub(a, b);
  return detail::with_tangent(y, d, [&](Var<T> t) {
    const Var<T> product = slope(d.value()) * t;
    return weights.empty() ? mean(product) : weighted_mean(product, weights);
  });
}

}  // namespace

template <class T>
Dual<T> mse_loss(const Dual<T>& a, const Dual<T>& b, std::span<const std::type_identity_t<T>> weights) {
  return of_difference<T>(mse_loss(a.value(), b.value(), weights), a, b, weights,
                          [](Var<T> d) { return T(2) * d; });
}

template <class T>
Dual<T> l1_loss(const Dual<T>& a, const Dual<T>& b, std::span<const std::type_identity_t<T>> weights) {
  return of_difference<T>(l1_loss(a.value(), b.value(), weights), a, b, weights, [](Var<T> d) {
    const Var<T> zero = detail::filled(d.tape(), Shape{1}, 0);
    return greater(d, zero) - less(d, zero);
  });
}

template <class T>
Dual<T> huber_loss(const Dual<T>& a, const Dual<T>& b, double delta,
                   std::span<const std::type_identity_t<T>> weights) {
  return of_difference<T>(huber_loss(a.value(), b.value(), delta, weights), a, b, weights,
                          [=](Var<T> d) { return clamp(d, -delta, delta); });
}

template <class T>
Dual<T> bce_with_logits(const Dual<T>& logits, std::span<const std::type_identity_t<T>> targets,
                        std::span<const std::type_identity_t<T>> weights) {
  const Var<T> x = logits.value();
  return detail::with_tangent(bce_with_logits(x, targets, weights), logits, [&](Var<T> dx) {
    const Var<T> product = (sigmoid(x) - x.tape().constant(targets.data(), x.shape())) * dx;
    return weights.empty() ? mean(product) : weighted_mean(product, weights);
  });
}

// Replaces rows that do not count by zeros, since they may hold anything.
template <class T>
Dual<T> softmax_cross_entropy(const Dual<T>& logits, std::span<const std::int32_t> labels,
                              std::span<const std::type_identity_t<T>> weights) {
  return detail::with_tangent(softmax_cross_entropy(logits.value(), labels, weights), logits, [&](Var<T> dx) {
    Tape<T>& tape = logits.tape();
    const Index columns = logits.shape()[-1], rows = static_cast<Index>(labels.size());
    T *one_hot = tape.scratch(rows * columns), *counts = tape.scratch(rows);
    std::fill_n(one_hot, rows * columns, T(0));
    for (Index r = 0; r < rows; ++r) {
      const Index label = labels[at(r)];
      if (label >= 0) one_hot[r * columns + label] = 1;
      counts[r] = label < 0 ? T(0) : weights.empty() ? T(1) : weights[at(r)];
    }
    const Shape shape{rows, columns};
    const Var<T> counted = tape.constant(counts, {rows, 1});
    const Var<T> p = softmax(detail::only(counted, reshape(logits.value(), shape)));
    const Var<T> slope = p - tape.constant(one_hot, shape);
    const Var<T> row_sums = sum(slope * detail::only(counted, reshape(dx, shape)), {1});
    return weighted_mean(row_sums, std::span<const T>(counts, labels.size()));
  });
}

namespace {

// x / (|x| + e) over the last axis, as feature_distance() scales; 0 with a tangent of 0 where x is 0.
template <class T>
Dual<T> scaled_to_unit(const Dual<T>& x) {
  constexpr T kSmall = static_cast<T>(1e-10);
  const Dual<T> squares = sum(square(x), {-1}, KeepAxes::yes);
  const Var<T> zero = detail::filled(x.tape(), Shape{1}, 0), one = detail::filled(x.tape(), Shape{1}, 1);
  const Var<T> nothing = equal(squares.value(), zero);
  return where(nothing, Dual<T>(zero), x / (sqrt(where(nothing, Dual<T>(one), squares)) + kSmall));
}

}  // namespace

template <class T>
Dual<T> feature_distance(const Dual<T>& a, const Dual<T>& b,
                         std::span<const std::type_identity_t<T>> weights) {
  const Var<T> y = feature_distance(a.value(), b.value(), weights);
  if (!a.has_tangent() && !b.has_tangent()) return y;
  const Dual<T> d = scaled_to_unit(a) - scaled_to_unit(b);
  const Var<T> w = y.tape().constant(weights.data(), {d.shape()[-1]});
  return {y, T(2) * mean(sum(d.value() * d.tangent() * w, {3}), {1, 2})};
}

#define FIELDMARK_DUAL_LOSS(T)                                                                               \
  template Dual<T> mse_loss(const Dual<T>&, const Dual<T>&, std::span<const T>);                             \
  template Dual<T> l1_loss(const Dual<T>&, const Dual<T>&, std::span<const T>);                              \
  template Dual<T> huber_loss(const Dual<T>&, const Dual<T>&, double, std::span<const T>);                   \
  template Dual<T> bce_with_logits(const Dual<T>&, std::span<const T>, std::span<const T>);                  \
  template Dual<T> softmax_cross_entropy(const Dual<T>&, std::span<const std::int32_t>, std::span<const T>); \
  template Dual<T> feature_distance(const Dual<T>&, const Dual<T>&, std::span<const T>);
FIELDMARK_DUAL_LOSS(float)
FIELDMARK_DUAL_LOSS(double)
#undef FIELDMARK_DUAL_LOSS

}  // namespace fieldmark
