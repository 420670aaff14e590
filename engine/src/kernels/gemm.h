#pragma once
#include <fieldmark/engine/kernel.h>

namespace fieldmark::kernels {

/// C[i, j] = start + sum_{s, k} A[i, s, k] B[s K + k, j], where start is C's old value, the bias or 0, and
/// the result may pass through a ReLU. A is read at a[i a_row + s a_segment + k a_col], so that it can be a
/// matrix, its transpose, or the windows of an image (the rows of a convolution are the segments). B comes
/// from pack_panels(), or is a row-major matrix of whole vectors of columns read in place: b_row = length of
/// its rows, b_panel = gemm_panel(n).
template <class T>
struct Gemm {
  Index m = 0, n = 0, k = 0, segments = 1;
  const T* a = nullptr;
  Index a_row = 0, a_col = 1, a_segment = 0;
  const T* b = nullptr;
  Index b_row = 0;    ///< distance between rows; 0: gemm_panel(n)
  Index b_panel = 0;  ///< distance between panels; 0: they follow each other
  T* c = nullptr;     ///< row-major, rows ldc apart
  Index ldc = 0;
  const T* bias = nullptr;  ///< [n]; not with accumulate
  const T* mask = nullptr;  ///< laid out like C, which becomes 0 where it is not positive: a ReLU's backward
  bool accumulate = false, relu = false;
};

/// Returns the width of the panels of a matrix with `columns` columns on this instruction set: a few vectors,
/// and no more than the columns fill.
FIELDMARK_DECLARE_KERNEL(template <class T> Index, gemm_panel, (Index columns))

/// Packs B [rows, columns], read at b[i row + j column], into panels of gemm_panel(columns)
/// columns: panel after panel, each row-major and contiguous, the last padded with zeros. Unpacked, the rows
/// of one panel would fall into few sets of the cache. If `mask` (laid out like b) is given, entries at which
/// it is not positive become 0: the backward of a ReLU.
FIELDMARK_DECLARE_KERNEL(template <class T> void, pack_panels,
                         (const T* b, Index rows, Index columns, Index row, Index column, const T* mask,
                          T* out))

/// Copies D [rows, columns] to rows of `row` >= columns elements, padded with zeros; entries at which
/// `mask` (laid out like D; null: none) is not positive become 0 too.
FIELDMARK_DECLARE_KERNEL(template <class T> void, pad_rows,
                         (const T* d, Index rows, Index columns, const T* mask, Index row, T* out))

FIELDMARK_DECLARE_KERNEL(template <class T> void, gemm, (const Gemm<T>& g))

/// Adds to sums [columns] the sums of the columns of B [rows, columns], laid out as in Gemm.
FIELDMARK_DECLARE_KERNEL(template <class T> void, column_sums,
                         (const T* b, Index rows, Index columns, Index b_row, Index b_panel, T* sums))

}  // namespace fieldmark::kernels
