#pragma once
#include <span>
#include <string>

#include "ops/chunks.h"

namespace fieldmark::detail {

// Checks a mean's optional weights (empty: all 1) and returns the reciprocal of their sum, 0 where there is
// nothing to average.
template <class T>
double inverse_total(Tape<T>& tape, const char* op, Index n, std::span<const T> weights) {
  if (weights.empty()) return n > 0 ? 1.0 / static_cast<double>(n) : 0.0;
  if (static_cast<Index>(weights.size()) != n)
    throw ShapeError(std::string("[") + op + "] weights must have one element for each of the " +
                     std::to_string(n) + " averaged, got " + std::to_string(weights.size()));
  for (std::size_t i = 0; i < weights.size(); ++i)
    if (!(weights[i] >= 0))
      throw ValueError(std::string("[") + op + "] weights: entry " + std::to_string(i) +
                       " must be 0 or more, got " + std::to_string(weights[i]));
  const double total = chunked_sum(tape, n, [w = weights.data()](Index i) { return w[i]; });
  return total > 0 ? 1 / total : 0.0;
}

// y = sum_i w_i f(i) / sum w, [1], and its backward dx_i = dy w_i slope(i) / sum w for x, and minus
// that for `other` where given. A chunk owns its elements.
template <class T, class F, class D>
Var<T> mean_of(const char* op, Var<T> x, const Var<T>* other, std::span<const T> weights, F f, D slope,
               std::source_location from = std::source_location::current()) {
  Tape<T>& tape = x.tape();
  const Index n = x.shape().size();
  const double inverse = inverse_total(tape, op, n, weights);
  const T* w = weights.empty() ? nullptr : weights.data();
  T* y = nullptr;
  const Var<T> second = other ? *other : x;
  const Var<T> out = tape.output({1}, &y, {x, second}, from);
  *y = static_cast<T>(inverse * chunked_sum(tape, n, [=](Index i) {
                        return (w ? static_cast<double>(w[i]) : 1.0) * static_cast<double>(f(i));
                      }));
  tape.on_backward(out, [x, second, two = other != nullptr, w, inverse, slope](const T* dy) {
    const T g = static_cast<T>(inverse * static_cast<double>(*dy));
    add_gradient(x, [=](Index i) { return (w ? g * w[i] : g) * slope(i); });
    if (two) add_gradient(second, [=](Index i) { return -(w ? g * w[i] : g) * slope(i); });
  });
  return out;
}

}  // namespace fieldmark::detail
