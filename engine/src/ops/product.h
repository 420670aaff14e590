#pragma once
// Products of row-major matrices on the gemm kernel, shared by matmul, dense and conv2d. Private.
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/tape.h>

#include "kernels/gemm.h"

namespace fieldmark::detail {

constexpr Index kProductRows = 1024;  // rows a piece, where a product runs on several threads
constexpr Index kProductShards = 16;  // partial sums over rows, added in order

inline Index round_up(Index n, Index to) { return (n + to - 1) / to * to; }

template <class T>
Index panel_width(Index columns) {
  using namespace kernels;
  return FIELDMARK_KERNEL(gemm_panel<T>)(columns);
}

/// Numbers in the panels of a matrix [rows, columns].
template <class T>
Index panels_size(Index rows, Index columns) {
  return rows * round_up(columns, panel_width<T>(columns));
}

template <class T>
void pack(const T* b, Index rows, Index columns, Index row, Index column, const T* mask, T* out) {
  using namespace kernels;
  FIELDMARK_KERNEL(pack_panels<T>)(b, rows, columns, row, column, mask, out);
}

/// B [rows, columns] at b[i row + j column] in panels; room comes from the tape.
template <class T>
T* packed(Tape<T>& tape, const T* b, Index rows, Index columns, Index row, Index column,
          const T* mask = nullptr) {
  T* out = tape.scratch(panels_size<T>(rows, columns));
  pack(b, rows, columns, row, column, mask, out);
  return out;
}

/// Rows of W^T, W [in, out], with which dX = dY W^T reads dY in panels: those of a last panel that `out` does
/// not fill are zeros, unless it is the only one.
template <class T>
Index transposed_rows(Index out) {
  const Index panel = panel_width<T>(out);
  return out > panel ? round_up(out, panel) : out;
}
template <class T>
Index transposed_size(Index in, Index out) {
  return panels_size<T>(transposed_rows<T>(out), in);
}
/// W^T [transposed_rows(out), in] in panels.
template <class T>
void pack_transposed(const T* w, Index in, Index out, T* to) {
  const Index rows = transposed_rows<T>(out), panel = panel_width<T>(in);
  pack(w, out, in, Index{1}, out, static_cast<const T*>(nullptr), to);
  if (rows == out) return;
  // Panels of `out` rows become panels of `rows`, from the last on: none is written before it was moved.
  for (Index p = round_up(in, panel) / panel - 1; p >= 0; --p) {
    std::copy_backward(to + p * out * panel, to + (p + 1) * out * panel, to + (p * rows + out) * panel);
    std::fill_n(to + (p * rows + out) * panel, (rows - out) * panel, T(0));
  }
}

/// Runs a product in pieces of rows; a row of C has one owner.
template <class T>
void product(const kernels::Gemm<T>& g) {
  using namespace kernels;
  const auto run = FIELDMARK_KERNEL(gemm<T>);
  parallel_for(g.m, kProductRows, [&](Index begin, Index end) {
    Gemm<T> piece = g;
    piece.m = end - begin;
    piece.a += begin * g.a_row;
    piece.c += begin * g.ldc;
    run(piece);
  });
}

/// into [size] += sum over `items` of what f(begin, end, to) adds to `to`: directly where there are at most
/// `grain` items, else in up to 16 fixed parts, each with a buffer from the tape, added in order.
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

/// into [columns] += the sums of the columns of d, which packed() laid out from [rows, columns].
template <class T>
void add_column_sums(const T* d, Index rows, Index columns, T* into) {
  using namespace kernels;
  FIELDMARK_KERNEL(column_sums<T>)(d, rows, columns, into);
}

}  // namespace fieldmark::detail
