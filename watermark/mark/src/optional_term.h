#pragma once
// A loss term that a view may lack. Private.
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/reduce.h>

#include <algorithm>
#include <span>

namespace fieldmark::watermark {

// Returns term(), a mean over x with these weights, or 0, with gradient 0 in x, where all weights are 0: a
// view may show no object, and the mean of nothing is an error.
template <class F>
Var<float> term_or_zero(Var<float> x, std::span<const float> weights, F term) {
  if (std::any_of(weights.begin(), weights.end(), [](float w) { return w != 0; })) return term();
  return scale(sum(x), 0);
}

}  // namespace fieldmark::watermark
