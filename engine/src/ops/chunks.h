#pragma once
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/tape.h>

namespace fieldmark::detail {

// Elements in one chunk of an elementwise loop: 128 KiB of float, enough work to outweigh waking a thread.
constexpr Index kGrain = Index{1} << 15;

// Returns the number of rows of `width` elements in one chunk of a loop over rows.
inline Index row_grain(Index width) { return std::max<Index>(1, kGrain / std::max<Index>(1, width)); }

// Copies what a backward will read to the tape: the caller's data may be gone by then.
template <class T, class U>
const U* kept(Tape<T>& tape, std::span<const U> from) {
  U* to = tape.template scratch<U>(std::ssize(from));
  std::copy(from.begin(), from.end(), to);
  return to;
}

// Calls f(image, first, count) for chunks of `grain` pixels of every image.
template <class F>
void for_image_chunks(Index images, Index pixels, Index grain, F f) {
  const Index chunks = (pixels + grain - 1) / grain;
  parallel_for(images * chunks, 1, [&](Index chunk, Index) {
    const Index first = chunk % chunks * grain;
    f(chunk / chunks, first, std::min(grain, pixels - first));
  });
}

// Sums f(i) over [0, n) with eight double sums per chunk and adds the chunks in order, so that the bits do
// not depend on the thread count. The relative error is below 2^-53 (kGrain / 8 + 8 + chunks) times sum |f| /
// |sum f|.
template <class T, class F>
double chunked_sum(Tape<T>& tape, Index n, F f) {
  const Index chunks = (n + kGrain - 1) / kGrain;
  auto* partial = tape.template scratch<double>(chunks);
  parallel_for(n, kGrain, [&](Index begin, Index end) {
    double acc[8] = {};
    Index i = begin;
    for (; i + 8 <= end; i += 8)
      for (int k = 0; k < 8; ++k) acc[k] += static_cast<double>(f(i + k));
    for (; i < end; ++i) acc[0] += static_cast<double>(f(i));
    partial[begin / kGrain] =
        ((acc[0] + acc[1]) + (acc[2] + acc[3])) + ((acc[4] + acc[5]) + (acc[6] + acc[7]));
  });
  double sum = 0;
  for (Index p = 0; p < chunks; ++p) sum += partial[p];
  return sum;
}

// Sums channel c over the partial sums [chunks, channels], in order.
inline double channel_total(const double* sums, Index chunks, Index channels, Index c) {
  double total = 0;
  for (Index k = 0; k < chunks; ++k) total += sums[k * channels + c];
  return total;
}

// dx[i] = or += f(i) for all i, in parallel if dx is long.
template <class T, class F>
void add_gradient(Var<T> x, F f) {
  bool fresh = false;
  T* dx = x.grad_acc(&fresh);
  if (!dx) return;
  parallel_for(x.shape().size(), kGrain, [&](Index begin, Index end) {
    if (fresh)
      for (Index i = begin; i < end; ++i) dx[i] = f(i);
    else
      for (Index i = begin; i < end; ++i) dx[i] += f(i);
  });
}

}  // namespace fieldmark::detail
