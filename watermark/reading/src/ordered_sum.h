#pragma once
// Sums over pixels by chunks, added in order: the same bits for any number of threads. Private.
#include <fieldmark/engine/parallel.h>

#include <utility>
#include <vector>

namespace fieldmark::watermark {

constexpr Index kPixelChunk = 512;  // pixels: 50 us of a tone fit, more than waking a thread takes

/// Lets f(begin, end, part) add each chunk of [0, n) to a part of its own, and returns the sum of the parts
/// in the order of the chunks.
/// @param zero  additive identity, from which every part starts; `+=` adds parts   @param f  called by
/// several threads at a time   @param chunk  size of a chunk, at least 1
template <class Sum, class F>
Sum ordered_sum(Index n, const Sum& zero, F f, Index chunk = kPixelChunk) {
  std::vector<Sum> parts(static_cast<std::size_t>((n + chunk - 1) / chunk));
  parallel_for(n, chunk, [&](Index begin, Index end) {
    Sum part = zero;  // local: neighbours in `parts` share cache lines with other threads
    f(begin, end, part);
    parts[static_cast<std::size_t>(begin / chunk)] = std::move(part);
  });
  Sum sum = zero;
  for (const Sum& part : parts) sum += part;
  return sum;
}

}  // namespace fieldmark::watermark
