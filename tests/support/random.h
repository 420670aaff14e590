#pragma once
#include <fieldmark/engine/tensor.h>

#include <random>

/// Same numbers on every machine and run for the same seed.
template <class T = double>
fieldmark::Tensor<T> uniform(fieldmark::Shape shape, double lo, double hi, unsigned seed) {
  fieldmark::Tensor<T> t(shape);
  std::mt19937_64 rng(seed);
  for (T& v : t.data) v = static_cast<T>(lo + (hi - lo) * static_cast<double>(rng() >> 11) * 0x1.0p-53);
  return t;
}
