#pragma once
// Entries of an axis by index, and its transpose. Private.
#include <cstdint>
#include <string>

#include "ops/axes.h"

namespace fieldmark::detail {

inline void check_index(const char* op, std::span<const std::int32_t> index, Index extent,
                        const std::string& what) {
  for (std::size_t i = 0; i < index.size(); ++i)
    if (index[i] < 0 || index[i] >= extent)
      throw ValueError(std::string("[") + op + "] index: entry " + std::to_string(i) + " must be in [0, " +
                       std::to_string(extent) + ") (" + what + "), got " + std::to_string(index[i]));
}

// y[o, i, :] = x[o, at[i], :] for n entries of x[outer, rows, inner]. A chunk owns its entries of y.
template <class T>
void take(const T* x, Split p, const std::int32_t* at, Index n, T* y, bool assign) {
  parallel_for(p.outer * n, row_grain(p.inner), [=](Index begin, Index end) {
    for (Index e = begin; e < end; ++e) {
      const T* from = x + (e / n * p.n + at[e % n]) * p.inner;
      T* to = y + e * p.inner;
      if (assign)
        std::copy_n(from, p.inner, to);
      else
        for (Index c = 0; c < p.inner; ++c) to[c] += from[c];
    }
  });
}

// x[o, r, :] += sum of y[o, i, :] over the i with at[i] = r, which a counting sort lists in order. A chunk
// owns its entries of x.
template <class T>
void add_taken(Tape<T>& tape, const T* y, Split p, const std::int32_t* at, Index n, T* x) {
  auto* start = tape.template scratch<Index>(p.n + 1);
  auto* taker = tape.template scratch<Index>(n);
  std::fill_n(start, p.n + 1, Index{0});
  for (Index i = 0; i < n; ++i) ++start[at[i] + 1];
  for (Index r = 0; r < p.n; ++r) start[r + 1] += start[r];
  // Filling from the back leaves start[r + 1] at the first taker of entry r.
  for (Index i = n; i-- > 0;) taker[--start[at[i] + 1]] = i;
  parallel_for(p.outer * p.n, row_grain(p.inner), [=](Index begin, Index end) {
    for (Index e = begin; e < end; ++e) {
      const Index o = e / p.n, r = e % p.n, last = r + 1 < p.n ? start[r + 2] : n;
      for (Index k = start[r + 1]; k < last; ++k)
        for (Index c = 0; c < p.inner; ++c) x[e * p.inner + c] += y[(o * n + taker[k]) * p.inner + c];
    }
  });
}

// Implements gather() and gather_rows().
template <class T>
Var<T> gather(const char* op, Var<T> x, int axis, std::span<const std::int32_t> index,
              const std::string& what, std::source_location from = std::source_location::current()) {
  check_index(op, index, x.shape()[axis], what);
  const Split p = split(x.shape(), axis);
  const auto n = static_cast<Index>(index.size());
  T* y = nullptr;
  const Var<T> out = x.tape().output(with_extent(x.shape(), axis, n), &y, {x}, from);
  const std::int32_t* i = kept(x.tape(), index);
  take(x.value(), p, i, n, y, true);

  // dx[o, r] = the sum of dy[o, i] over the i with index[i] = r.
  x.tape().on_backward(out, [x, p, n, i](const T* dy) { add_taken(x.tape(), dy, p, i, n, x.grad_acc()); });
  return out;
}

}  // namespace fieldmark::detail
