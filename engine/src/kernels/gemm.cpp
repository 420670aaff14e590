#include "kernels/gemm.h"

#include <fieldmark/engine/simd.h>

#include <cstring>

namespace fieldmark::kernels::FIELDMARK_ISA_NS {
namespace {

using simd::kLanes;
using simd::Vec;

// Vectors of a full panel, and rows of a register block V vectors wide. A block has at most 12 accumulators
// in 16 registers, or 24 in AVX-512's 32, and at least 8 if there are enough rows, which hides the latency of
// a multiply-add.
constexpr int kVectors = simd::kBytes == 64 ? 4 : 2;
constexpr int rows_of(int vectors) {
  const int most = simd::kBytes == 64 ? 24 : 12;
  return most / vectors < 12 ? most / vectors : 12;
}
template <class T>
constexpr int kPanel = kVectors* kLanes<T>;

// A block with sums this long takes a microsecond or more, and its elements of C may have left L2 since the
// previous block. So a block prefetches the elements of C that it overwrites and those of the mask. If it
// adds to C, it prefetches those of the next block, since it needs its own at once.
constexpr Index kLongSum = 128;

template <class T, int R, int V>
[[gnu::always_inline]] inline void prefetch_ends(const Gemm<T>& g, const T* c, Index ldc, const T* mask) {
  constexpr int kToWrite = 1;
  const T* written = g.accumulate ? c + R * ldc : c;
  for (int i = 0; i < R; ++i)
    for (int j = 0; j < V; ++j) {
      __builtin_prefetch(written + i * ldc + j * kLanes<T>, kToWrite);
      if (mask) __builtin_prefetch(mask + i * ldc + j * kLanes<T>);
    }
}

// Computes one block of C in registers; the rows of B are `stride` apart. far: C may have left the caches.
template <class T, int R, int V, bool far = true>
[[gnu::always_inline]] inline void block(const Gemm<T>& g, const T* a, const T* b, Index stride, T* c,
                                         Index ldc, const T* bias, const T* mask) {
  constexpr int L = kLanes<T>;
  if constexpr (far)
    if (g.k >= kLongSum) prefetch_ends<T, R, V>(g, c, ldc, mask);
  Vec<T> acc[R][V];
  for (int i = 0; i < R; ++i)
    for (int j = 0; j < V; ++j)
      acc[i][j] = g.accumulate ? simd::load(c + i * ldc + j * L) : bias ? simd::load(bias + j * L) : Vec<T>{};
  // Each step prefetches one line of A: of the next block, or, where A is read by columns, of this block 16
  // steps ahead. The activations of a chunk come from L3 or memory, and hardware prefetching does not hide
  // that latency.
  const bool by_rows = g.a_col == 1 && g.k > 0;
  const T* ahead = by_rows ? a + R * g.a_row : a + 16 * g.a_col;
  const Index on = by_rows ? R * g.a_row / g.k : g.a_col;
  for (Index s = 0; s < g.segments; ++s, a += g.a_segment) {
    const T* p = a;
    for (Index k = 0; k < g.k; ++k, p += g.a_col, b += stride, ahead += on) {
      __builtin_prefetch(ahead);
      Vec<T> row[V];
      for (int j = 0; j < V; ++j) row[j] = simd::load(b + j * L);
      for (int i = 0; i < R; ++i) {
        const T x = p[i * g.a_row];
        for (int j = 0; j < V; ++j) acc[i][j] += x * row[j];
      }
    }
  }
  if (mask)
    for (int i = 0; i < R; ++i)
      for (int j = 0; j < V; ++j)
        acc[i][j] = simd::load(mask + i * ldc + j * L) > Vec<T>{} ? acc[i][j] : Vec<T>{};
  // A comparison with NaN is false and must select the sum, so that NaN stays NaN.
  for (int i = 0; i < R; ++i)
    for (int j = 0; j < V; ++j)
      simd::store(c + i * ldc + j * L, g.relu ? simd::max(Vec<T>{}, acc[i][j]) : acc[i][j]);
}

// The rows of the next smaller block.
constexpr int fewer_rows(int rows) { return rows > 8 ? 8 : rows > 4 ? 4 : rows / 2; }

// All rows of V vectors of columns: blocks of R rows, then ever smaller blocks for the rest.
template <class T, int V, int R = rows_of(V)>
void panel(const Gemm<T>& g, const T* b, Index stride, Index column, Index i = 0) {
  const T *bias = g.bias ? g.bias + column : nullptr, *mask = g.mask ? g.mask + column : nullptr;
  for (; i + R <= g.m; i += R)
    block<T, R, V>(g, g.a + i * g.a_row, b, stride, g.c + i * g.ldc + column, g.ldc, bias,
                   mask ? mask + i * g.ldc : nullptr);
  if constexpr (R > 1)
    if (i < g.m) panel<T, V, fewer_rows(R)>(g, b, stride, column, i);
}

// Copies n < 2 most elements in pieces of constant size, which the compiler turns into one move each.
template <int most, class T>
[[gnu::always_inline]] inline void copy_few(const T* from, T* to, int n) {
  if (n & most) {
    std::memcpy(to, from, most * sizeof(T));
    from += most;
    to += most;
  }
  if constexpr (most > 1) copy_few<most / 2>(from, to, n);
}

// Columns that do not fill a vector: C passes through a separate block.
template <class T, int R = rows_of(1)>
void narrow(const Gemm<T>& g, const T* b, Index stride, Index column, int columns, Index i = 0) {
  constexpr int W = kLanes<T>;
  const auto copy = [=](const T* from, T* to) { copy_few<W / 2>(from, to, columns); };
  T bias[W] = {}, mask[W] = {}, c[R * W] = {};
  if (g.bias) copy(g.bias + column, bias);
  for (; i + R <= g.m; i += R) {
    const Index at = i * g.ldc + column;
    if (g.accumulate)
      for (int r = 0; r < R; ++r) copy(g.c + at + r * g.ldc, c + r * W);
    block<T, R, 1, false>(g, g.a + i * g.a_row, b, stride, c, W, bias, nullptr);
    for (int r = 0; r < R; ++r) {
      if (g.mask) {
        copy(g.mask + at + r * g.ldc, mask);
        const Vec<T> sum = simd::load(c + r * W);
        simd::store(c + r * W, simd::load(mask) > Vec<T>{} ? sum : Vec<T>{});
      }
      copy(c + r * W, g.c + at + r * g.ldc);
    }
  }
  if constexpr (R > 1)
    if (i < g.m) narrow<T, fewer_rows(R)>(g, b, stride, column, columns, i);
}

// Row i of a full panel: whole vectors, without the checks of a loop over any width.
template <class T>
[[gnu::always_inline]] inline void pack_full_row(const T* from, const T* mask, Index panel, T* out) {
  for (Index x = 0; x < panel; x += kLanes<T>) {
    const Vec<T> v = simd::load(from + x);
    simd::store(out + x, !mask ? v : simd::load(mask + x) > Vec<T>{} ? v : Vec<T>{});
  }
}

// Row i of a panel: `width` elements, then zeros.
template <class T>
[[gnu::always_inline]] inline void pack_row(const T* from, const T* mask, Index column, int width,
                                            Index panel, T* out) {
  if (mask)
    for (int x = 0; x < width; ++x) out[x] = mask[x * column] > 0 ? from[x * column] : T(0);
  else
    for (int x = 0; x < width; ++x) out[x] = from[x * column];
  for (Index x = width; x < panel; ++x) out[x] = 0;
}

}  // namespace

template <class T>
Index gemm_panel(Index columns) {
  constexpr int L = kLanes<T>;
  return columns >= kPanel<T> ? kPanel<T> : columns > L ? (columns + L - 1) / L * L : L;
}

template <class T>
void pack_panels(const T* b, Index rows, Index columns, Index row, Index column, const T* mask, T* out) {
  const Index panel = gemm_panel<T>(columns);
  for (Index j = 0; j < columns; j += panel) {
    const int width = static_cast<int>(columns - j < panel ? columns - j : panel);
    for (Index i = 0; i < rows; ++i, out += panel) {
      const Index at = i * row + j * column;
      const T* m = mask ? mask + at : nullptr;
      if (column == 1 && width == panel)
        pack_full_row(b + at, m, panel, out);
      else if (column == 1)
        pack_row(b + at, m, 1, width, panel, out);
      else
        pack_row(b + at, m, column, width, panel, out);
    }
  }
}

template <class T>
void pad_rows(const T* d, Index rows, Index columns, const T* mask, Index row, T* out) {
  if (row == columns) {
    const Index n = rows * columns, whole = n / kLanes<T> * kLanes<T>;
    pack_full_row(d, mask, whole, out);
    return pack_row(d + whole, mask ? mask + whole : nullptr, 1, static_cast<int>(n - whole), n - whole,
                    out + whole);
  }
  for (Index i = 0; i < rows; ++i)
    pack_row(d + i * columns, mask ? mask + i * columns : nullptr, 1, static_cast<int>(columns), row,
             out + i * row);
}

// If the rows of B of all segments do not fit into L1 together, processes all of C one segment at a time, so
// that every block of rows of C finds the segment's rows of B in L1. The order of the sums is the same.
template <class T>
void by_segments(const Gemm<T>& g, Index stride, Index step) {
  for (Index s = 0; s < g.segments; ++s) {
    Gemm<T> part = g;
    const bool last = s + 1 == g.segments;
    part.segments = 1;
    part.a += s * g.a_segment;
    part.b += s * g.k * stride;
    part.b_panel = step;
    part.accumulate = g.accumulate || s > 0;
    part.relu = g.relu && last;
    part.mask = last ? g.mask : nullptr;
    gemm(part);
  }
}

template <class T>
void gemm(const Gemm<T>& g) {
  constexpr int L = kLanes<T>;
  constexpr Index kSegmentBytes = 8192;  // below this, storing C in between costs more
  const Index width = gemm_panel<T>(g.n), stride = g.b_row ? g.b_row : width;
  const Index step = g.b_panel ? g.b_panel : g.segments * g.k * stride;
  if (g.segments > 1 && g.k * width * static_cast<Index>(sizeof(T)) >= kSegmentBytes)
    return by_segments(g, stride, step);
  const T* b = g.b;
  for (Index j = 0; j < g.n; j += width, b += step) {
    const int columns = static_cast<int>(g.n - j < width ? g.n - j : width), full = columns / L * L;
    switch (columns / L) {
      case 1:
        panel<T, 1>(g, b, stride, j);
        break;
      case 2:
        panel<T, 2>(g, b, stride, j);
        break;
      case 3:
        panel<T, kVectors == 4 ? 3 : 1>(g, b, stride, j);
        break;
      case 4:
        panel<T, kVectors == 4 ? 4 : 1>(g, b, stride, j);
        break;
      default:
        break;
    }
    if (full < columns) narrow<T>(g, b + full, stride, j + full, columns - full);
  }
}

// Sums one panel of V vectors; two sums for each hide the latency of an addition.
template <class T, int V>
void panel_sums(const T* panel, Index rows, Index stride, T* out) {
  constexpr int L = kLanes<T>;
  Vec<T> even[V] = {}, odd[V] = {};
  Index i = 0;
  for (; i + 2 <= rows; i += 2, panel += 2 * stride)
    for (int v = 0; v < V; ++v) {
      even[v] += simd::load(panel + v * L);
      odd[v] += simd::load(panel + stride + v * L);
    }
  if (i < rows)
    for (int v = 0; v < V; ++v) even[v] += simd::load(panel + v * L);
  for (int v = 0; v < V; ++v) simd::store(out + v * L, even[v] + odd[v]);
}

template <class T>
void sums_of_panel(const T* panel, Index rows, Index stride, Index vectors, T* out) {
  switch (vectors) {
    case 1:
      return panel_sums<T, 1>(panel, rows, stride, out);
    case 2:
      return panel_sums<T, 2>(panel, rows, stride, out);
    case 3:
      return panel_sums < T, kVectors == 4 ? 3 : 1 > (panel, rows, stride, out);
    default:
      return panel_sums<T, kVectors>(panel, rows, stride, out);
  }
}

template <class T>
void column_sums(const T* b, Index rows, Index columns, Index b_row, Index b_panel, T* sums) {
  constexpr Index kRows = 512;  // summed in T; blocks of them in double, so that long sums stay exact
  const Index width = gemm_panel<T>(columns);
  T block[kPanel<T>];
  for (Index j = 0; j < columns; j += width, b += b_panel) {
    const Index left = columns - j < width ? columns - j : width,
                vectors = (left + kLanes<T> - 1) / kLanes<T>;
    double total[kPanel<T>] = {};
    for (Index i = 0; i < rows; i += kRows) {
      sums_of_panel(b + i * b_row, rows - i < kRows ? rows - i : kRows, b_row, vectors, block);
      for (Index x = 0; x < left; ++x) total[x] += static_cast<double>(block[x]);
    }
    for (Index x = 0; x < left; ++x) sums[j + x] += static_cast<T>(total[x]);
  }
}

#define FIELDMARK_INSTANTIATE(T)                                                 \
  template Index gemm_panel<T>(Index);                                           \
  template void pack_panels(const T*, Index, Index, Index, Index, const T*, T*); \
  template void column_sums(const T*, Index, Index, Index, Index, T*);           \
  template void pad_rows(const T*, Index, Index, const T*, Index, T*);           \
  template void gemm(const Gemm<T>&);
FIELDMARK_INSTANTIATE(float)
FIELDMARK_INSTANTIATE(double)

}  // namespace fieldmark::kernels::FIELDMARK_ISA_NS
