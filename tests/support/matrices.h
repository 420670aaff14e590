#pragma once
#include "support/random.h"

/// Returns random square matrices [.., n, n] in [-1, 1), with 3, 4, .. added to the diagonal.
template <class T = double>
fieldmark::Tensor<T> regular(fieldmark::Shape shape, unsigned seed) {
  fieldmark::Tensor<T> t = uniform<T>(shape, -1, 1, seed);
  const fieldmark::Index n = shape[-1];
  for (fieldmark::Index i = 0; i < t.size(); ++i)
    if (i / n % n == i % n) t[i] += static_cast<T>(3 + i % n);
  return t;
}
