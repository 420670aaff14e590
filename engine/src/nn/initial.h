#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <span>

#include <fieldmark/engine/params.h>

namespace fieldmark::detail {

/// Fills uniformly in +-sqrt(6 / fan_in): He et al. 2015, eq. 10, uniform form.
template <class T>
void he_uniform(std::span<T> weights, Index fan_in, std::uint64_t seed) {
  // Not CounterRng: recorded results depend on these bits, which the C++ standard fixes, and a layer is
  // filled once, in order, so nothing needs a number by its index.
  std::mt19937_64 rng(seed);
  const double bound = std::sqrt(6.0 / static_cast<double>(fan_in));
  for (T& w : weights) w = static_cast<T>(bound * (2 * static_cast<double>(rng() >> 11) * 0x1.0p-53 - 1));
}

/// Records a layer's bias on the tape: its parameter, or zeros [n] if it has none.
template <class T>
Var<T> bias_or_zeros(Tape<T>& tape, const Params<T>& params, ParamId bias, Index n) {
  if (bias.index >= 0) return params.leaf(tape, bias);
  T* zeros = tape.scratch(n);
  std::fill_n(zeros, n, T(0));
  return tape.constant(zeros, {n});
}

}  // namespace fieldmark::detail
