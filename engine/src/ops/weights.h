#pragma once
#include <fieldmark/core/number_text.h>

#include <span>
#include <string>

#include "ops/chunks.h"

namespace fieldmark::detail {

// Checks the optional weights of a mean (empty: all 1), one for each of n elements.
template <class T>
void check_weights(const char* op, Index n, std::span<const T> weights) {
  if (weights.empty()) return;
  if (static_cast<Index>(weights.size()) != n)
    throw ShapeError(std::string("[") + op + "] weights must have one element for each of the " +
                     std::to_string(n) + " averaged, got " + std::to_string(weights.size()));
  for (std::size_t i = 0; i < weights.size(); ++i)
    if (!(weights[i] >= 0))
      throw ValueError(std::string("[") + op + "] weights: entry " + std::to_string(i) +
                       " must be 0 or more, got " + number_text(weights[i]));
}

// Checks the elements and weights of a mean and returns the reciprocal of the sum of weights.
template <class T>
double inverse_total(Tape<T>& tape, const char* op, const Shape& s, std::span<const T> weights) {
  const Index n = s.size();
  if (n == 0)
    throw ShapeError(std::string("[") + op + "] there must be at least one element to average, got shape " +
                     s.str());
  check_weights(op, n, weights);
  if (weights.empty()) return 1 / static_cast<double>(n);
  const double total = chunked_sum(tape, n, [w = weights.data()](Index i) { return w[i]; });
  if (total == 0)
    throw ValueError(std::string("[") + op + "] weights: at least one must be above 0, got only zeros");
  return 1 / total;
}

// y = sum_i w_i f(i) / sum w, [1], with its backward dx_i = dy w_i slope(i) / sum w for x, and the negative
// of it for `other` if given. A chunk owns its elements.
template <class T, class F, class D>
Var<T> mean_of(const char* op, Var<T> x, const Var<T>* other, std::span<const T> weights, F f, D slope,
               std::source_location from = std::source_location::current()) {
  Tape<T>& tape = x.tape();
  const Index n = x.shape().size();
  const double inverse = inverse_total(tape, op, x.shape(), weights);
  const T* w = weights.empty() ? nullptr : kept(tape, weights);
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
