#pragma once
// A term of a loss that a view may not have. Private.
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/reduce.h>

#include <algorithm>
#include <span>

namespace fieldmark::watermark {

// term(), a mean of something of x with these weights, or 0, with a gradient of 0 in x, where no weight
// counts: a view may show no object, and a mean of nothing is an error.
template <class F>
Var<float> term_or_zero(Var<float> x, std::span<const float> weights, F term) {
  if (std::any_of(weights.begin(), weights.end(), [](float w) { return w != 0; })) return term();
  return scale(sum(x), 0);
}

}  // namespace fieldmark::watermark
