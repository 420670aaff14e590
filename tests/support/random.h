#pragma once
#include <fieldmark/engine/tensor.h>

#include <random>

/// Returns the same numbers for the same seed on every machine.
template <class T = double>
fieldmark::Tensor<T> uniform(fieldmark::Shape shape, double lo, double hi, unsigned seed) {
  fieldmark::Tensor<T> t(shape);
  std::mt19937_64 rng(seed);
  for (T& v : t.data) v = static_cast<T>(lo + (hi - lo) * static_cast<double>(rng() >> 11) * 0x1.0p-53);
  return t;
}
