#pragma once
// Sums over chunks of a loop, added in order: the same bits for any number of threads. Private.
#include <fieldmark/engine/parallel.h>

#include <vector>

namespace fieldmark::watermark {

constexpr Index kPixelChunk = 4096;  // pixels of a chunk: enough work to outweigh waking a thread

/// Returns the sum of f(begin, end, part) over [0, n) in chunks of kPixelChunk. Each chunk starts from a copy
/// of `zero`; `f` adds to it, and `+=` adds the chunks in order.
template <class Sum, class F>
Sum ordered_sum(Index n, const Sum& zero, F f) {
  std::vector<Sum> parts(static_cast<std::size_t>((n + kPixelChunk - 1) / kPixelChunk), zero);
  parallel_for(n, kPixelChunk, [&](Index begin, Index end) {
    f(begin, end, parts[static_cast<std::size_t>(begin / kPixelChunk)]);
  });
  Sum sum = zero;
  for (const Sum& part : parts) sum += part;
  return sum;
}

}  // namespace fieldmark::watermark
