#pragma once
// Products of row-major matrices on the gemm kernel, shared by matmul, dense and conv2d. Private.
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/tape.h>

#include <algorithm>

#include "kernels/gemm.h"
#include "kernels/gemm_bf16.h"

namespace fieldmark::detail {

constexpr Index kProductRows = 1024;  // most rows of a chunk if a product runs on several threads
constexpr Index kBlockRows = 96;      // a multiple of the rows of every kernel's register block
constexpr Index kProductShards = 16;  // partial sums over rows, added in order

inline Index round_up(Index n, Index to) { return (n + to - 1) / to * to; }

/// Returns the rows per chunk of a product of m rows: two million multiplications, enough to outweigh waking
/// a thread, in whole register blocks. Few rows, as in a training loop over chunks, stay together. The sum of
/// an element does not depend on its chunk.
inline Index product_rows(Index m, Index n, Index k) {
  constexpr Index kWork = Index{1} << 21, kFew = 256;
  if (m <= kFew) return kFew;
  const Index rows = kWork / std::max<Index>(1, n * k);
  return rows >= kProductRows ? kProductRows : std::max(kBlockRows, rows / kBlockRows * kBlockRows);
}

template <class T>
Index panel_width(Index columns) {
  using namespace kernels;
  return FIELDMARK_KERNEL(gemm_panel<T>)(columns);
}

/// Returns the number of elements of the panels of a matrix [rows, columns].
template <class T>
Index panels_size(Index rows, Index columns) {
  return rows * round_up(columns, panel_width<T>(columns));
}

template <class T>
void pack(const T* b, Index rows, Index columns, Index row, Index column, const T* mask, T* out) {
  using namespace kernels;
  FIELDMARK_KERNEL(pack_panels<T>)(b, rows, columns, row, column, mask, out);
}

/// Packs B [rows, columns], read at b[i row + j column], into panels on the tape.
template <class T>
T* packed(Tape<T>& tape, const T* b, Index rows, Index columns, Index row, Index column,
          const T* mask = nullptr) {
  T* out = tape.scratch(panels_size<T>(rows, columns));
  pack(b, rows, columns, row, column, mask, out);
  return out;
}

/// Runs a product in chunks of rows; each row of C has one owner.
template <class T>
void product(const kernels::Gemm<T>& g) {
  using namespace kernels;
  const auto run = FIELDMARK_KERNEL(gemm<T>);
  parallel_for(g.m, product_rows(g.m, g.n, g.k * g.segments), [&](Index begin, Index end) {
    Gemm<T> chunk = g;
    chunk.m = end - begin;
    chunk.a += begin * g.a_row;
    chunk.c += begin * g.ldc;
    if (g.mask) chunk.mask += begin * g.ldc;
    run(chunk);
  });
}

/// Overload for inputs rounded to bf16.
inline void product(const kernels::GemmBf16& g) {
  using namespace kernels;
  const auto run = FIELDMARK_KERNEL(gemm_bf16);
  parallel_for(g.m, kProductRows, [&](Index begin, Index end) {
    GemmBf16 chunk = g;
    chunk.m = end - begin;
    chunk.a += begin * g.a_row;
    chunk.c += begin * g.ldc;
    if (g.mask) chunk.mask += begin * g.ldc;
    chunk.tiles = bf16_units() == Bf16Units::tiles;
    run(chunk);
  });
}

/// into [size] += the sums that f(begin, end, to) adds to `to` over all `items`: directly for at most `grain`
/// items, else in up to 16 fixed parts, each with a buffer from the tape, added in order.
template <class T, class F>
void sharded_sum(Tape<T>& tape, Index items, Index grain, T* into, Index size, F&& f) {
  const Index shards = std::min(kProductShards, (items + grain - 1) / grain);
  if (shards <= 1) {
    f(Index{0}, items, into);
    return;
  }
  T* buffers = tape.scratch(shards * size);
  parallel_for(shards, 1, [&](Index s, Index) {
    T* to = buffers + s * size;
    std::fill_n(to, size, T(0));
    f(s * items / shards, (s + 1) * items / shards, to);
  });
  for (Index s = 0; s < shards; ++s)
    for (Index i = 0; i < size; ++i) into[i] += buffers[s * size + i];
}

/// Rounds `columns` up to whole vectors: the row stride that products need to read a matrix in place.
template <class T>
Index whole_row(Index columns) {
  return round_up(columns, panel_width<T>(1));
}

/// Adds the column sums of d, whose row stride is whole_row(columns), to into [columns].
template <class T>
void add_column_sums(const T* d, Index rows, Index columns, T* into) {
  using namespace kernels;
  FIELDMARK_KERNEL(column_sums<T>)
  (d, rows, columns, whole_row<T>(columns), panel_width<T>(columns), into);
}

}  // namespace fieldmark::detail
