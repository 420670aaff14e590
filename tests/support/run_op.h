#pragma once
#include <fieldmark/engine/isa.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/tape.h>

#include <cmath>
#include <cstring>
#include <span>
#include <vector>

#include "support/catch.h"
#include "support/random.h"
#include "support/worst.h"

/// An op under test is a generic callable f(tape, std::span<const Var<T>>) -> Var<T>.
/// Returns the op's values, then the gradient of <u, f> in each input for a fixed random cotangent u. As in a
/// network, the inputs are outputs of another op, and memory holds NaN until it is filled.
template <class T, class F>
std::vector<std::vector<T>> run_op(const F& f, const std::vector<fieldmark::Tensor<T>>& inputs) {
  fieldmark::Tape<T> tape;
  tape.arena().spoil();
  std::vector<fieldmark::Tensor<T>> grads;
  for (const auto& x : inputs) grads.emplace_back(x.shape);
  std::vector<fieldmark::Var<T>> vars;
  for (std::size_t k = 0; k < inputs.size(); ++k)
    vars.push_back(tape.reshape(tape.leaf(inputs[k], grads[k]), inputs[k].shape));
  const fieldmark::Var<T> y = f(tape, std::span<const fieldmark::Var<T>>(vars));
  tape.backward(y, uniform<T>(y.shape(), -1, 1, 99).data);
  std::vector<std::vector<T>> result{{y.value(), y.value() + y.shape().size()}};
  for (auto& g : grads) result.push_back(g.data);
  return result;
}

/// Returns the values alone, with the inputs as constants.
template <class T, class F>
std::vector<T> op_values(const F& f, const std::vector<fieldmark::Tensor<T>>& inputs) {
  fieldmark::Tape<T> tape;
  std::vector<fieldmark::Var<T>> vars;
  for (const auto& x : inputs) vars.push_back(tape.constant(x));
  const fieldmark::Var<T> y = f(tape, std::span<const fieldmark::Var<T>>(vars));
  return {y.value(), y.value() + y.shape().size()};
}

/// Fails unless float values and gradients have the same bits on one, two and three threads.
template <class F>
void expect_same_bits(const F& f, const std::vector<fieldmark::Tensor<float>>& inputs) {
  const auto on = [&](int threads) {
    const fieldmark::ScopedThreads scope(threads);
    return run_op(f, inputs);
  };
  const auto one = on(1);
  for (const int threads : {2, 3}) {
    const auto other = on(threads);
    for (std::size_t k = 0; k < one.size(); ++k)
      CHECK(std::memcmp(one[k].data(), other[k].data(), one[k].size() * sizeof(float)) == 0);
  }
}

/// Returns the largest |float - double| over the values and each gradient, relative to the largest magnitude
/// of each, on the worst instruction set of this CPU.
template <class F>
double float_error(const F& f, const std::vector<fieldmark::Tensor<float>>& inputs) {
  std::vector<fieldmark::Tensor<double>> exact;
  for (const auto& x : inputs) exact.emplace_back(x.shape, std::vector<double>(x.data.begin(), x.data.end()));
  const auto want = run_op(f, exact);
  double worst = 0;
  for (auto level : {fieldmark::Isa::v2, fieldmark::Isa::v3, fieldmark::Isa::v4}) {
    if (level > fieldmark::isa_supported()) continue;
    const fieldmark::ScopedIsa scope(level);
    const auto got = run_op(f, inputs);
    for (std::size_t k = 0; k < want.size(); ++k) {
      double largest = 1e-30, off = 0;
      for (std::size_t i = 0; i < want[k].size(); ++i) {
        raise_to(largest, std::abs(want[k][i]));
        const double d = std::abs(static_cast<double>(got[k][i]) - want[k][i]);
        raise_to(off, d);
      }
      raise_to(worst, off / largest);
    }
  }
  return worst;
}

/// Returns the largest float_error() of an op over extents from 1 to 130, which cover whole vectors and every
/// remainder.
/// @param inputs  called as inputs(extent)
template <class F, class I>
double float_error_to_130(const F& f, const I& inputs) {
  double worst = 0;
  for (fieldmark::Index e = 1; e <= 130; ++e) raise_to(worst, float_error(f, inputs(e)));
  return worst;
}
