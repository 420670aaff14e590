#pragma once
// Checks of the windows of convolutions and pools. Private.
#include <fieldmark/core/error.h>
#include <fieldmark/engine/shape.h>

#include <algorithm>
#include <initializer_list>
#include <string>

namespace fieldmark::detail {

// Sizes, strides, paddings and dilations in pixels are at most this: their sums and products do not overflow.
constexpr Index kLargestStep = (Index{1} << 31) - 1;

inline void check_step(const char* op, const char* argument, Index value, Index least) {
  if (value >= least && value <= kLargestStep) return;
  throw ValueError(std::string("[") + op + "] " + argument + " must be " + std::to_string(least) + " to " +
                   std::to_string(kLargestStep) + ", got " + std::to_string(value));
}

// True if a buffer of these extents has fewer than 2^60 elements, also with every 0 taken as 1: the sizes in
// bytes of what an op needs then do not overflow.
inline bool is_countable(std::initializer_list<Index> extents) {
  Index all = 1;
  for (const Index n : extents)
    if (__builtin_mul_overflow(all, std::max<Index>(1, n), &all)) return false;
  return all < Index{1} << 60;
}

}  // namespace fieldmark::detail
