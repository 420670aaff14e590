#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/ops/dense.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/ops/reduce.h>

#include "numerics_cases_parts.h"

namespace fieldmark {
namespace {

using Real = long double;
constexpr Index kPixels = 3'000'000;

template <class T, class F>
T one_value(const F& op, const Tensor<T>& x) {
  Tape<T> tape;
  return op(tape.constant(x)).value()[0];
}

// A running float sum of such values stops growing near 2^24 / 10.
template <class T>
void compare_sums(WorstError& error) {
  const auto x = scattered<T>({kPixels}, 0.1, 1, 8), w = scattered<T>({kPixels}, 0, 1, 9);
  Real total = 0, squares = 0, weighted = 0, weights = 0;
  for (Index i = 0; i < kPixels; ++i) {
    total += x[i];
    squares += static_cast<Real>(x[i]) * x[i];
    weighted += static_cast<Real>(x[i]) * w[i];
    weights += w[i];
  }
  const Tensor<T> zero({kPixels});
  const auto check = [&](T got, Real want) { error.compare(got, want, want); };
  check(one_value<T>([](auto v) { return sum(v); }, x), total);
  check(one_value<T>([](auto v) { return mean(v); }, x), total / kPixels);
  check(one_value<T>([&](auto v) { return weighted_mean<T>(v, w.data); }, x), weighted / weights);
  check(one_value<T>([&](auto v) { return mse_loss(v, v.tape().constant(zero)); }, x), squares / kPixels);
}

// Pairs of 1e6 and 1/16 - 1e6: exact in double sums, lost in float sums.
template <class T>
void compare_cancelling_sum(WorstError& error) {
  Tensor<T> x({kPixels});
  for (Index i = 0; i < kPixels; ++i) x[i] = i % 2 == 0 ? T(1e6) : T(0.0625 - 1e6);
  error.equal(one_value<T>([](auto v) { return sum(v); }, x), Real{0.0625} * Real{kPixels} / 2);
}

// All roundings have the same sign.
template <class T>
void compare_equal_pixels(WorstError& error) {
  const Tensor<T> x({1, 1000, 1000, 3}, T(0.1));
  const auto got = one_value<T>([](auto v) { return global_avg_pool(v); }, x);
  error.compare(got, x[0], x[0]);
}

// Gradients of a layer over many rows, relative to the sum of the magnitudes of the terms.
template <class T>
void compare_long_gradients(WorstError& error) {
  constexpr Index rows = 300'000, in = 3, out = 5;
  const std::vector<Tensor<T>> inputs{scattered<T>({rows, in}, 0, 1, 1), scattered<T>({in, out}, -1, 1, 2),
                                      scattered<T>({out}, -1, 1, 3)};
  const auto g = scattered<T>({rows, out}, -1, 1, 4);
  const auto got =
      values_and_gradients<T>([](auto&, const auto& v) { return dense(v[0], v[1], v[2], Activation::none); },
                              inputs, [&](Shape) -> const Tensor<T>& { return g; });
  for (Index j = 0; j < out; ++j)
    for (Index k = 0; k <= in; ++k) {
      Real sum = 0, size = 0;
      for (Index r = 0; r < rows; ++r) {
        const Real term = static_cast<Real>(g[r * out + j]) * (k < in ? inputs[0][r * in + k] : T(1));
        sum += term;
        size += std::abs(term);
      }
      error.compare(
          k < in ? got[2][static_cast<std::size_t>(k * out + j)] : got[3][static_cast<std::size_t>(j)], sum,
          size);
    }
}

// Algorithm 1 of Kingma and Ba in long double, after 20 steps with the same gradient, relative to one step.
template <class T>
void compare_adam(WorstError& error) {
  const std::vector<double> gradients{0, 1e-30, 1e-18, 1e-15, 1e-12, 1e-6, 1, 1e6, 1e12, 1e18};
  const auto n = static_cast<Index>(gradients.size());
  const AdamOptions o{.lr = 1e-3, .beta2 = 0.99, .eps = 1e-15};
  Adam<T> adam(n, o);
  Tensor<T> x({n}, T(0));
  std::vector<Real> want(gradients.size()), m = want, v = want;
  for (int t = 1; t <= 20; ++t) {
    Tensor<T> g({n});
    for (std::size_t i = 0; i < want.size(); ++i) {
      g.data[i] = static_cast<T>((t % 3 == 0 ? -1 : 1) * gradients[i]);
      const Real exact = g.data[i], b1 = o.beta1, b2 = o.beta2;
      m[i] = b1 * m[i] + (1 - b1) * exact;
      v[i] = b2 * v[i] + (1 - b2) * exact * exact;
      want[i] -= o.lr * (m[i] / (1 - std::pow(b1, t))) / (std::sqrt(v[i] / (1 - std::pow(b2, t))) + o.eps);
    }
    adam.step(x.data, g.data);
  }
  for (std::size_t i = 0; i < want.size(); ++i) error.compare(x.data[i], want[i], o.lr);
}

// Without a gradient no parameter moves; with skip_zero no moment decays either.
template <class T>
void compare_adam_at_rest(WorstError& error) {
  for (const bool skip : {false, true}) {
    Adam<T> adam(100, {.skip_zero = skip});
    auto x = scattered<T>({100}, -1, 1, 1);
    const auto before = x;
    if (skip) std::fill(adam.mean().begin(), adam.mean().end(), T(0.5));
    Tensor<T> g({100});
    for (int t = 0; t < 10; ++t) adam.step(x.data, g.data);
    for (Index i = 0; i < 100; ++i) error.equal(x[i], before[i]);
    for (const T m : adam.mean()) error.equal(m, skip ? T(0.5) : T(0));
  }
}

}  // namespace

void add_sum_numerics(std::vector<NumericsCase>& cases) {
  add_numerics(cases, "reduce, loss: three million pixels", "value", 6e-8, 1e-15,
               [](auto t, WorstError& e) { compare_sums<decltype(t)>(e); });
  add_numerics(cases, "reduce: three million pixels that cancel", "bits", 0, 0,
               [](auto t, WorstError& e) { compare_cancelling_sum<decltype(t)>(e); });
  add_numerics(cases, "pool: mean of a million equal pixels", "value", 3e-7, 2e-14,
               [](auto t, WorstError& e) { compare_equal_pixels<decltype(t)>(e); });
  add_numerics(cases, "dense: dw and db of 300,000 rows", "sum of sizes", 1e-6, 1e-15,
               [](auto t, WorstError& e) { compare_long_gradients<decltype(t)>(e); });
  add_numerics(cases, "adam: 20 steps with gradients from 1e-30 to 1e18", "one step", 1e-5, 1e-14,
               [](auto t, WorstError& e) { compare_adam<decltype(t)>(e); });
  add_numerics(cases, "adam: zero gradients", "bits", 0, 0,
               [](auto t, WorstError& e) { compare_adam_at_rest<decltype(t)>(e); });
}

}  // namespace fieldmark
