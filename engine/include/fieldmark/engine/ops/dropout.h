#pragma once
#include <fieldmark/engine/random.h>
#include <fieldmark/engine/tape.h>

namespace fieldmark {

/// Applies dropout: sets each element to 0 with probability p and scales the others so that the mean stays.
///   y_i = x_i / (1 - p) where word i mod 4 of rng.bits(step, i / 4) is at least 2^32 p, else 0 x_i
/// Source: Srivastava et al. 2014 (Dropout: a simple way to prevent neural networks from overfitting).
/// @param x  any shape   @param p  in [0, 1); 0 returns x itself
/// @param rng  with a separate stream for each layer   @param step  training step; each has its own mask
/// @return the shape of x
/// @throws ValueError if p is outside [0, 1)
/// Differentiable in: x, with the mask of the forward pass.
template <class T>
Var<T> dropout(Var<T> x, double p, const CounterRng& rng, std::uint64_t step);

}  // namespace fieldmark
