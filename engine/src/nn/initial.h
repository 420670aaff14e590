#pragma once
#include <cmath>
#include <cstdint>
#include <random>
#include <span>

#include <fieldmark/engine/shape.h>

namespace fieldmark::detail {

/// Uniform in +-sqrt(6 / fan_in): He et al. 2015, eq. 10, uniform form.
template <class T>
void he_uniform(std::span<T> weights, Index fan_in, std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  const double bound = std::sqrt(6.0 / static_cast<double>(fan_in));
  for (T& w : weights) w = static_cast<T>(bound * (2 * static_cast<double>(rng() >> 11) * 0x1.0p-53 - 1));
}

}  // namespace fieldmark::detail
