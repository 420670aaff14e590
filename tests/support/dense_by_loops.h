#pragma once
#include <fieldmark/engine/params.h>

#include <algorithm>
#include <string>
#include <vector>

/// The activations of one sample.
using Row = std::vector<double>;

/// Applies a named dense layer to a row by plain loops.
inline Row layer(const fieldmark::ParamStore<double>& store, const std::string& name, const Row& x,
                 bool relu) {
  const auto w = store.values(store.find(name + "/weight")), b = store.values(store.find(name + "/bias"));
  Row y(b.begin(), b.end());
  for (std::size_t j = 0; j < y.size(); ++j) {
    for (std::size_t i = 0; i < x.size(); ++i) y[j] += x[i] * w[i * y.size() + j];
    if (relu) y[j] = std::max(0.0, y[j]);
  }
  return y;
}
