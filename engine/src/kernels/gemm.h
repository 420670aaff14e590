#pragma once
#include <fieldmark/engine/isa.h>

#include <cstdint>

namespace fieldmark::kernels {

/// C[i, j] = start + sum_{s, k} A[i, s, k] B[s K + k, j], where start is C's old value, the bias or 0, and
/// the result may pass through a ReLU. A is read at a[i a_row + s a_segment + k a_col], so that it can be a
/// matrix, its transpose, or the windows of a picture (a convolution's rows are the segments). B comes from
/// pack_panels().
template <class T>
struct Gemm {
  std::int64_t m = 0, n = 0, k = 0, segments = 1;
  const T* a = nullptr;
  std::int64_t a_row = 0, a_col = 1, a_segment = 0;
  const T* b = nullptr;
  std::int64_t b_panel = 0;  ///< distance between panels; 0: they follow each other
  T* c = nullptr;            ///< row-major, rows ldc apart
  std::int64_t ldc = 0;
  const T* bias = nullptr;  ///< [n]; not with accumulate
  bool accumulate = false, relu = false;
};

/// Width of the panels of a matrix of so many columns on this instruction set: a few vectors, and no more
/// than the columns fill.
FIELDMARK_DECLARE_KERNEL(template <class T> std::int64_t, gemm_panel, (std::int64_t columns))

/// Packs B [rows, columns], read at b[i row + j column], into panels of gemm_panel(columns)
/// columns: panel after panel, each row-major and contiguous, the last filled up with zeros. Without it the
/// rows of one panel fall into few sets of the cache. Where `mask` (laid out as b) is given, entries at which
/// it is not positive become 0: the backward of a ReLU.
FIELDMARK_DECLARE_KERNEL(template <class T> void, pack_panels,
                         (const T* b, std::int64_t rows, std::int64_t columns, std::int64_t row,
                          std::int64_t column, const T* mask, T* out))

FIELDMARK_DECLARE_KERNEL(template <class T> void, gemm, (const Gemm<T>& g))

/// Adds to sums [columns] the sums of the columns of a matrix [rows, columns] that pack_panels() laid out.
FIELDMARK_DECLARE_KERNEL(template <class T> void, column_sums,
                         (const T* panels, std::int64_t rows, std::int64_t columns, T* sums))

}  // namespace fieldmark::kernels
