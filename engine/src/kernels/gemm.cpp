#include "kernels/gemm.h"

#include <fieldmark/engine/simd.h>

namespace fieldmark::kernels::FIELDMARK_ISA_NS {
namespace {

using simd::kLanes;
using simd::Vec;

// Rows x vectors of the register block: 12 accumulators of 16 registers, or 24 of AVX-512's 32.
constexpr int kRows = 6;
constexpr int kVectors = simd::kBytes == 64 ? 4 : 2;
template <class T>
constexpr int kPanel = kVectors* kLanes<T>;

// One block of C in registers; B's rows are a panel's width apart.
template <class T, int R, int V>
[[gnu::always_inline]] inline void block(const Gemm<T>& g, const T* a, const T* b, T* c, std::int64_t ldc,
                                         const T* bias) {
  constexpr int L = kLanes<T>;
  Vec<T> acc[R][V];
  for (int i = 0; i < R; ++i)
    for (int j = 0; j < V; ++j)
      acc[i][j] = g.accumulate ? simd::load(c + i * ldc + j * L) : bias ? simd::load(bias + j * L) : Vec<T>{};
  for (std::int64_t s = 0; s < g.segments; ++s, a += g.a_segment) {
    const T* p = a;
    for (std::int64_t k = 0; k < g.k; ++k, p += g.a_col, b += kPanel<T>) {
      Vec<T> row[V];
      for (int j = 0; j < V; ++j) row[j] = simd::load(b + j * L);
      for (int i = 0; i < R; ++i) {
        const T x = p[i * g.a_row];
        for (int j = 0; j < V; ++j) acc[i][j] += x * row[j];
      }
    }
  }
  for (int i = 0; i < R; ++i)
    for (int j = 0; j < V; ++j)
      simd::store(c + i * ldc + j * L, g.relu ? simd::max(acc[i][j], Vec<T>{}) : acc[i][j]);
}

// All rows of V vectors of columns.
template <class T, int V>
void panel(const Gemm<T>& g, const T* b, T* c, const T* bias) {
  std::int64_t i = 0;
  for (; i + kRows <= g.m; i += kRows)
    block<T, kRows, V>(g, g.a + i * g.a_row, b, c + i * g.ldc, g.ldc, bias);
  for (; i + 2 <= g.m; i += 2) block<T, 2, V>(g, g.a + i * g.a_row, b, c + i * g.ldc, g.ldc, bias);
  for (; i < g.m; ++i) block<T, 1, V>(g, g.a + i * g.a_row, b, c + i * g.ldc, g.ldc, bias);
}

// Columns that do not fill their vectors: C passes through a block of its own.
template <class T, int V>
void narrow(const Gemm<T>& g, const T* b, std::int64_t j, int columns) {
  constexpr int W = V * kLanes<T>;
  T bias[W] = {}, c[kRows * W] = {};
  if (g.bias)
    for (int x = 0; x < columns; ++x) bias[x] = g.bias[j + x];
  for (std::int64_t i = 0; i < g.m; i += kRows) {
    const int count = static_cast<int>(g.m - i < kRows ? g.m - i : kRows);
    if (g.accumulate)
      for (int r = 0; r < count; ++r)
        for (int x = 0; x < columns; ++x) c[r * W + x] = g.c[(i + r) * g.ldc + j + x];
    if (count == kRows)
      block<T, kRows, V>(g, g.a + i * g.a_row, b, c, W, bias);
    else
      for (int r = 0; r < count; ++r) block<T, 1, V>(g, g.a + (i + r) * g.a_row, b, c + r * W, W, bias);
    for (int r = 0; r < count; ++r)
      for (int x = 0; x < columns; ++x) g.c[(i + r) * g.ldc + j + x] = c[r * W + x];
  }
}

}  // namespace

template <class T>
std::int64_t gemm_panel() {
  return kPanel<T>;
}

template <class T>
void pack_panels(const T* b, std::int64_t rows, std::int64_t columns, std::int64_t row, std::int64_t column,
                 const T* mask, T* out) {
  for (std::int64_t j = 0; j < columns; j += kPanel<T>) {
    const int width = static_cast<int>(columns - j < kPanel<T> ? columns - j : kPanel<T>);
    for (std::int64_t i = 0; i < rows; ++i, out += kPanel<T>) {
      const T* from = b + i * row + j * column;
      if (mask) {
        const T* m = mask + i * row + j * column;
        for (int x = 0; x < width; ++x) out[x] = m[x * column] > 0 ? from[x * column] : T(0);
      } else if (column == 1 && width == kPanel<T>) {
        for (int v = 0; v < kVectors; ++v) simd::store(out + v * kLanes<T>, simd::load(from + v * kLanes<T>));
      } else {
        for (int x = 0; x < width; ++x) out[x] = from[x * column];
      }
      for (int x = width; x < kPanel<T>; ++x) out[x] = 0;
    }
  }
}

template <class T>
void gemm(const Gemm<T>& g) {
  constexpr int L = kLanes<T>;
  const T* b = g.b;
  const std::int64_t step = g.b_panel ? g.b_panel : g.segments * g.k * kPanel<T>;
  for (std::int64_t j = 0; j < g.n; j += kPanel<T>, b += step) {
    const int columns = static_cast<int>(g.n - j < kPanel<T> ? g.n - j : kPanel<T>);
    const T* bias = g.bias ? g.bias + j : nullptr;
    if (columns == kPanel<T>)
      panel<T, kVectors>(g, b, g.c + j, bias);
    else if (columns == L)
      panel<T, 1>(g, b, g.c + j, bias);
    else if (columns < L)
      narrow<T, 1>(g, b, j, columns);
    else
      narrow<T, kVectors>(g, b, j, columns);
  }
}

#define FIELDMARK_INSTANTIATE(T)                                                                             \
  template std::int64_t gemm_panel<T>();                                                                     \
  template void pack_panels(const T*, std::int64_t, std::int64_t, std::int64_t, std::int64_t, const T*, T*); \
  template void gemm(const Gemm<T>&);
FIELDMARK_INSTANTIATE(float)
FIELDMARK_INSTANTIATE(double)

}  // namespace fieldmark::kernels::FIELDMARK_ISA_NS
