#pragma once
// Axes of shapes, and sums over them. Private.
#include <array>

#include "ops/chunks.h"

namespace fieldmark::detail {

// A shape split at one of its axes: x[outer, n, inner].
struct Split {
  Index outer = 1, n = 1, inner = 1;
};
inline Split split(const Shape& s, int axis) {
  Split p{.n = s[axis]};
  for (int k = 0; k < axis; ++k) p.outer *= s[k];
  for (int k = axis + 1; k < s.rank(); ++k) p.inner *= s[k];
  return p;
}

// Returns the shape with another extent of one axis.
inline Shape with_extent(const Shape& s, int axis, Index n) {
  std::array<Index, Shape::kMaxRank> extents{};
  for (int k = 0; k < s.rank(); ++k) extents[at(k)] = k == axis ? n : s[k];
  return Shape(std::span(extents).first(at(s.rank())));
}

// Axes, with neighbours of one kind joined; `summed` ones are summed over.
struct SummedAxes {
  int count = 0;
  std::array<Index, Shape::kMaxRank> extent{};
  std::array<bool, Shape::kMaxRank> summed{};

  void add(Index n, bool sum) {
    if (n == 1) return;
    if (count > 0 && summed[at(count - 1)] == sum) {
      extent[at(count - 1)] *= n;
      return;
    }
    extent[at(count)] = n;
    summed[at(count++)] = sum;
  }
};

// y[i] = sum_k x[k, i]; a single column is summed in eight partial sums, so that the loop vectorises.
template <class U>
void sum_rows(const U* x, Index n, Index inner, Index stride, double* y) {
  if (inner == 1 && stride == 1) {
    double acc[8] = {};
    Index k = 0;
    for (; k + 8 <= n; k += 8)
      for (Index j = 0; j < 8; ++j) acc[j] += static_cast<double>(x[k + j]);
    for (; k < n; ++k) acc[0] += static_cast<double>(x[k]);
    *y = ((acc[0] + acc[1]) + (acc[2] + acc[3])) + ((acc[4] + acc[5]) + (acc[6] + acc[7]));
    return;
  }
  std::fill_n(y, inner, 0.0);
  for (Index k = 0; k < n; ++k)
    for (Index i = 0; i < inner; ++i) y[i] += static_cast<double>(x[k * stride + i]);
}

// y[o, i] = sum_k x[o, k, i]. Chunks do not depend on the thread count and are added in order.
template <class T, class U>
void sum_middle(Tape<T>& tape, const U* x, Split p, double* y) {
  constexpr Index kColumns = 4096;
  const Index rows = row_grain(p.inner), chunks = (p.n + rows - 1) / rows;
  if (p.inner > kColumns) {
    const Index blocks = (p.inner + kColumns - 1) / kColumns;
    parallel_for(p.outer * blocks, 1, [&](Index b, Index) {
      const Index o = b / blocks, first = b % blocks * kColumns;
      sum_rows(x + o * p.n * p.inner + first, p.n, std::min(kColumns, p.inner - first), p.inner,
               y + o * p.inner + first);
    });
  } else if (chunks <= 1) {
    parallel_for(p.outer, row_grain(p.n * p.inner), [&](Index begin, Index end) {
      for (Index o = begin; o < end; ++o)
        sum_rows(x + o * p.n * p.inner, p.n, p.inner, p.inner, y + o * p.inner);
    });
  } else {
    auto* partial = tape.template scratch<double>(p.outer * chunks * p.inner);
    parallel_for(p.outer * chunks, 1, [&](Index c, Index) {
      const Index first = c % chunks * rows;
      sum_rows(x + (c / chunks * p.n + first) * p.inner, std::min(rows, p.n - first), p.inner, p.inner,
               partial + c * p.inner);
    });
    for (Index o = 0; o < p.outer; ++o)
      sum_rows(partial + o * chunks * p.inner, chunks, p.inner, p.inner, y + o * p.inner);
  }
}

// y = or += factor times the sums of x over the summed axes, in double; the innermost axes are summed first.
template <class T>
void put_sums(Tape<T>& tape, const T* x, const SummedAxes& axes, double factor, T* y, bool assign) {
  Index inner = 1;  // elements of the kept axes so far
  const double* sums = nullptr;
  for (int k = axes.count - 1; k >= 0; --k) {
    const Index n = axes.extent[at(k)];
    Index outer = 1;
    for (int j = 0; j < k; ++j) outer *= axes.extent[at(j)];
    if (!axes.summed[at(k)]) {
      inner *= n;
      continue;
    }
    auto* to = tape.template scratch<double>(outer * inner);
    if (sums)
      sum_middle(tape, sums, {outer, n, inner}, to);
    else
      sum_middle(tape, x, {outer, n, inner}, to);
    sums = to;
  }
  parallel_for(inner, kGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      const T value = static_cast<T>(factor * (sums ? sums[i] : static_cast<double>(x[i])));
      y[i] = assign ? value : y[i] + value;
    }
  });
}

}  // namespace fieldmark::detail
