#pragma once
#include <fieldmark/engine/kernel.h>

namespace fieldmark::kernels {

/// C[i, j] = start + sum_k A[i, k] B[k, j] with A and B rounded to bf16 (8 bits of mantissa, to nearest even)
/// and sums in float. Start, bias, mask and ReLU as in Gemm. B comes from pack_bf16().
struct GemmBf16 {
  Index m = 0, n = 0, k = 0;
  const float* a = nullptr;
  Index a_row = 0;
  const std::uint16_t* b = nullptr;
  float* c = nullptr;
  Index ldc = 0;
  const float* bias = nullptr;
  const float* mask = nullptr;
  bool accumulate = false, relu = false;
  bool tiles = false;  ///< AMX; otherwise AVX-512's dot products
};

/// Returns the number of elements that pack_bf16() writes for B [rows, columns].
constexpr Index bf16_size(Index rows, Index columns) {
  return (rows + 31) / 32 * 32 * ((columns + 15) / 16 * 16);
}

/// Rounds B [rows, columns], read at b[i row + j column], to bf16 in panels of 16 columns that interleave
/// pairs of rows: out[panel][pair of rows][column][row of the pair]. Rows are padded to a multiple of 32,
/// columns to a multiple of 16.
FIELDMARK_DECLARE_KERNEL(void, pack_bf16,
                         (const float* b, Index rows, Index columns, Index row, Index column,
                          std::uint16_t* out))

/// Rounds n elements to bf16.
FIELDMARK_DECLARE_KERNEL(void, round_bf16, (const float* x, Index n, std::uint16_t* out))

/// For v4 with bf16_units(). The other levels compute the product without special instructions, for tests.
FIELDMARK_DECLARE_KERNEL(void, gemm_bf16, (const GemmBf16& g))

}  // namespace fieldmark::kernels
