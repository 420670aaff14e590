#pragma once
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/tape.h>

namespace fieldmark::detail {

// Numbers in one piece of an elementwise loop: 128 KiB of float, well above the cost of waking a thread.
constexpr Index kGrain = Index{1} << 15;

// Rows of `width` numbers in one piece of a loop over rows.
inline Index row_grain(Index width) { return std::max<Index>(1, kGrain / std::max<Index>(1, width)); }

// sum of f(i) over [0, n): eight sums in double per piece, pieces added in order, so that the bits do not
// depend on the thread count. The relative error is below 2^-53 (kGrain / 8 + 8 + pieces) times sum |f| /
// |sum f|.
template <class T, class F>
double piece_sum(Tape<T>& tape, Index n, F f) {
  const Index pieces = (n + kGrain - 1) / kGrain;
  auto* partial = tape.template scratch<double>(pieces);
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
  for (Index p = 0; p < pieces; ++p) sum += partial[p];
  return sum;
}

// dx[i] = or += f(i) for all i, in parallel where it is long.
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
