#pragma once
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/tape.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "support/random.h"
#include "support/worst.h"

/// Runs an op on constants and returns its result.
template <class T, class F>
fieldmark::Tensor<T> op_result(const F& f, const std::vector<fieldmark::Tensor<T>>& inputs) {
  fieldmark::Tape<T> tape;
  std::vector<fieldmark::Var<T>> vars;
  for (const auto& t : inputs) vars.push_back(tape.constant(t));
  const fieldmark::Var<T> y = f(tape, std::span<const fieldmark::Var<T>>(vars));
  return {y.shape(), std::vector<T>(y.value(), y.value() + y.shape().size())};
}

/// Returns the result and all gradients for a varying cotangent as one list, to compare bits between thread
/// counts.
template <class T, class F>
std::vector<T> run_with_grads(const F& f, const std::vector<fieldmark::Tensor<T>>& inputs, int threads) {
  const fieldmark::ScopedThreads scope(threads);
  fieldmark::Tape<T> tape;
  std::vector<fieldmark::Tensor<T>> grads;
  for (const auto& t : inputs) grads.emplace_back(t.shape);
  std::vector<fieldmark::Var<T>> vars;
  for (std::size_t k = 0; k < inputs.size(); ++k) vars.push_back(tape.leaf(inputs[k], grads[k]));
  const fieldmark::Var<T> y = f(tape, std::span<const fieldmark::Var<T>>(vars));
  tape.backward(y, uniform<T>(y.shape(), -1, 1, 99).data);
  std::vector<T> all(y.value(), y.value() + y.shape().size());
  for (const auto& g : grads) all.insert(all.end(), g.data.begin(), g.data.end());
  return all;
}

/// Returns the largest |float - double| over the result and all gradients, relative to the largest of them.
template <class F>
double distortion_error(const F& f, const std::vector<fieldmark::Tensor<float>>& inputs) {
  std::vector<fieldmark::Tensor<double>> exact;
  for (const auto& x : inputs) exact.emplace_back(x.shape, std::vector<double>(x.data.begin(), x.data.end()));
  const auto got = run_with_grads<float>(f, inputs, fieldmark::threads());
  const auto want = run_with_grads<double>(f, exact, fieldmark::threads());
  double worst = 0, largest = 1e-30;
  for (std::size_t i = 0; i < want.size(); ++i) {
    const double error = std::abs(static_cast<double>(got[i]) - want[i]);
    raise_to(worst, error);
    raise_to(largest, std::abs(want[i]));
  }
  return worst / largest;
}

template <class T>
double largest_difference(const fieldmark::Tensor<T>& a, const fieldmark::Tensor<T>& b) {
  if (!(a.shape == b.shape)) return HUGE_VAL;
  double worst = 0;
  for (fieldmark::Index i = 0; i < a.size(); ++i) raise_to(worst, static_cast<double>(std::abs(a[i] - b[i])));
  return worst;
}

template <class T>
fieldmark::Tensor<T> number(double v) {
  return fieldmark::Tensor<T>({1}, static_cast<T>(v));
}
