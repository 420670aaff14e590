#pragma once
// Sums over pixels by chunks, added in order: the same bits for any number of threads. Private.
#include <fieldmark/engine/parallel.h>

#include <utility>
#include <vector>

namespace fieldmark::watermark {

constexpr Index kPixelChunk = 1024;  // pixels: 50 us of work or more, far more than waking a thread takes

/// Returns the sum over the chunks of [0, n) of what f(begin, end, part) adds to `part`.
/// @param zero  additive identity, from which every chunk starts; `+=` adds the chunks
/// @param f  called once a chunk, by several threads at a time   @param chunk  size of a chunk, at least 1
template <class Sum, class F>
Sum ordered_sum(Index n, const Sum& zero, F f, Index chunk = kPixelChunk) {
  std::vector<Sum> parts(static_cast<std::size_t>((n + chunk - 1) / chunk));
  parallel_for(n, chunk, [&](Index begin, Index end) {
    Sum part = zero;  // not in `parts`, whose neighbours other threads write
    f(begin, end, part);
    parts[static_cast<std::size_t>(begin / chunk)] = std::move(part);
  });
  Sum sum = zero;
  for (const Sum& part : parts) sum += part;
  return sum;
}

}  // namespace fieldmark::watermark
