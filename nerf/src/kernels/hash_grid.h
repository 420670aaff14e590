#pragma once
#include <fieldmark/engine/kernel.h>

#include <cstdint>

namespace fieldmark::kernels {

/// One level of a multiresolution hash grid.
struct HashLevel {
  std::uint32_t resolution;  ///< cells per axis, at least 1
  std::uint32_t mask;  ///< table size - 1 of a hashed level (a power of two), 0 for a level indexed directly
  std::int64_t first;  ///< row of the level's first entry in the table
};

// An entry holds `part` (2 or 4) features that only density reads, then as many that only colour reads.
// x [n, 3] positions in [0, 1]; table [rows, 2 part]; density and colour [n, part * levels], features of
// level l at part * l. Positions outside [0, 1] extrapolate the nearest cell's trilinear form; NaN falls in
// cell 0.
FIELDMARK_DECLARE_KERNEL(template <class T> void, hash_forward,
                         (const HashLevel* level, int levels, int part, const T* x, std::int64_t n,
                          const T* table, T* density, T* colour))
// As hash_forward, for a table rounded to bf16.
FIELDMARK_DECLARE_KERNEL(void, hash_forward_bf16,
                         (const HashLevel* level, int levels, int part, const float* x, std::int64_t n,
                          const std::uint16_t* table, float* density, float* colour))
// Sorts the gradients at density and colour (null: zeros) of points [begin, end) of n by level, entry by
// entry: out [levels, n, 2 part]. A level then reads its own gradients contiguously.
FIELDMARK_DECLARE_KERNEL(template <class T> void, hash_by_level,
                         (int levels, int part, const T* ddensity, const T* dcolour, std::int64_t begin,
                          std::int64_t end, std::int64_t n, T* out))
// Adds the gradient of ONE level, whose part of hash_by_level() is d [n, 2 part], to grad [rows, 2 part],
// point by point.
FIELDMARK_DECLARE_KERNEL(template <class T> void, hash_backward_level,
                         (const HashLevel& level, int part, const T* x, std::int64_t n, const T* d, T* grad))
// Adds the gradient with respect to the positions to dx [n, 3].
FIELDMARK_DECLARE_KERNEL(template <class T> void, hash_backward_x,
                         (const HashLevel* level, int levels, int part, const T* x, std::int64_t n,
                          const T* table, const T* ddensity, const T* dcolour, T* dx))

}  // namespace fieldmark::kernels
