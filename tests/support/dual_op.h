#pragma once
#include <fieldmark/engine/dual/arithmetic.h>
#include <fieldmark/engine/dual/reduce.h>
#include <fieldmark/engine/products.h>

#include <cmath>
#include <vector>

#include "support/catch.h"
#include "support/random.h"
#include "support/worst.h"

// f is a generic callable f(tape, x) of Vars or Duals, as in support/run_op.h.

/// The value and the first two derivatives of a function of one number at x, computed by Duals with a tangent
/// of 1.
struct Derivatives {
  double value, first, second;
};
template <class F>
Derivatives derivatives(const F& f, double x) {
  const fieldmark::Tensor<double> at({1}, x), one({1}, 1);
  const auto d = fieldmark::jvp(f, {at}, {one});
  return {d.value[0], d.product[0], fieldmark::hvp(f, {at}, {one}).products[0][0]};
}

/// Returns J v, then for each input the product H v for the sum of cubes of f. @param v  in [-1, 1], one for
/// each input
template <class T, class F>
std::vector<fieldmark::Tensor<T>> products_of(const F& f, const std::vector<fieldmark::Tensor<float>>& inputs,
                                              const std::vector<fieldmark::Tensor<float>>& v) {
  const auto as = [](const std::vector<fieldmark::Tensor<float>>& from) {
    std::vector<fieldmark::Tensor<T>> to;
    for (const auto& t : from) to.emplace_back(t.shape, std::vector<T>(t.data.begin(), t.data.end()));
    return to;
  };
  const auto cubes = [&](auto& tape, auto x) {
    const auto y = f(tape, x);
    return sum(mul(y, mul(y, y)));
  };
  std::vector<fieldmark::Tensor<T>> all{fieldmark::jvp<T>(f, as(inputs), as(v)).product};
  for (auto& p : fieldmark::hvp<T>(cubes, as(inputs), as(v)).products) all.push_back(std::move(p));
  return all;
}

/// Returns the largest |float - double| of products_of(), relative to the largest magnitude of each tensor.
template <class F>
double float_products_error(const F& f, const std::vector<fieldmark::Tensor<float>>& inputs) {
  std::vector<fieldmark::Tensor<float>> v;
  for (const auto& x : inputs)
    v.push_back(uniform<float>(x.shape, -1, 1, 7 + static_cast<unsigned>(v.size())));
  const auto got = products_of<float>(f, inputs, v);
  const auto want = products_of<double>(f, inputs, v);
  double worst = 0;
  for (std::size_t k = 0; k < want.size(); ++k) {
    double largest = 1e-30, off = 0;
    for (fieldmark::Index i = 0; i < want[k].size(); ++i) {
      raise_to(largest, std::abs(want[k][i]));
      raise_to(off, std::abs(static_cast<double>(got[k][i]) - want[k][i]));
    }
    raise_to(worst, off / largest);
  }
  return worst;
}
