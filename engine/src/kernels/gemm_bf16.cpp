#include "kernels/gemm_bf16.h"

#include <fieldmark/engine/simd.h>
#if defined(__AVX512BF16__)
#include <immintrin.h>
#endif

namespace fieldmark::kernels::FIELDMARK_ISA_NS {
namespace {

constexpr Index kRows = 32;    // rows of A rounded together
constexpr Index kDepth = 512;  // elements of a row that fit on the stack
constexpr Index kWidth = 16;   // columns of a panel of B

[[gnu::always_inline]] inline std::uint16_t rounded(float x) {
  std::uint32_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  if (x != x) return static_cast<std::uint16_t>((bits >> 16) | 0x40);  // a NaN stays one
  return static_cast<std::uint16_t>((bits + 0x7fff + ((bits >> 16) & 1)) >> 16);
}

// 32 rows of A, rounded, `depth` elements each (a multiple of 32), padded with zeros.
struct Rows {
  alignas(64) std::uint16_t at[kRows * kDepth];
  Index depth;

  void load(const float* a, Index a_row, Index rows, Index k) {
    depth = (k + 31) / 32 * 32;
    for (Index i = 0; i < kRows; ++i) {
      std::uint16_t* out = at + i * depth;
      Index x = 0;
      if (i < rows) {
#if defined(__AVX512BF16__)
        for (; x + 32 <= k; x += 32) {
          const __m512bh pair = _mm512_cvtne2ps_pbh(_mm512_loadu_ps(a + i * a_row + x + 16),
                                                    _mm512_loadu_ps(a + i * a_row + x));
          std::memcpy(out + x, &pair, sizeof pair);
        }
#endif
        for (; x < k; ++x) out[x] = rounded(a[i * a_row + x]);
      }
      for (; x < depth; ++x) out[x] = 0;
    }
  }
};

// Products of 32 rows with two panels of B, [32][2 x 16].
using Products = float[kRows * 2 * kWidth];

#if defined(__AVX512BF16__)
struct alignas(64) TileShapes {
  std::uint8_t palette = 1, start = 0, reserved[14] = {};
  std::uint16_t bytes[16] = {64, 64, 64, 64, 64, 64, 64, 64};
  std::uint8_t rows[16] = {16, 16, 16, 16, 16, 16, 16, 16};
};

// Tiles 0 to 3 accumulate, 4 and 5 hold rows, 6 and 7 hold the panels: every loaded tile is used twice.
void tile_products(const Rows& rows, const std::uint16_t* b, Index panel, Products& out) {
  _tile_zero(0);
  _tile_zero(1);
  _tile_zero(2);
  _tile_zero(3);
  const auto stride = static_cast<int>(2 * rows.depth);
  for (Index k = 0; k < rows.depth; k += 32) {
    _tile_loadd(4, rows.at + k, stride);
    _tile_loadd(5, rows.at + 16 * rows.depth + k, stride);
    _tile_loadd(6, b + k * kWidth, 64);
    _tile_loadd(7, b + panel + k * kWidth, 64);
    _tile_dpbf16ps(0, 4, 6);
    _tile_dpbf16ps(1, 4, 7);
    _tile_dpbf16ps(2, 5, 6);
    _tile_dpbf16ps(3, 5, 7);
  }
  _tile_stored(0, out, 128);
  _tile_stored(1, out + kWidth, 128);
  _tile_stored(2, out + 16 * 2 * kWidth, 128);
  _tile_stored(3, out + 16 * 2 * kWidth + kWidth, 128);
}

// Blocks of 8 rows and two panels: 16 sums hide the latency of a dot product.
void dot_products(const Rows& rows, const std::uint16_t* b, Index panel, Products& out) {
  constexpr int R = 8;
  for (Index i = 0; i < kRows; i += R) {
    __m512 sum[R][2] = {};
    for (Index k = 0; k < rows.depth; k += 2) {
      __m512bh column[2];
      for (int v = 0; v < 2; ++v) std::memcpy(&column[v], b + v * panel + k * kWidth, sizeof column[v]);
      for (int r = 0; r < R; ++r) {
        std::int32_t pair;
        std::memcpy(&pair, rows.at + (i + r) * rows.depth + k, sizeof pair);
        const __m512i both = _mm512_set1_epi32(pair);
        for (int v = 0; v < 2; ++v)
          sum[r][v] = _mm512_dpbf16_ps(sum[r][v], reinterpret_cast<const __m512bh&>(both), column[v]);
      }
    }
    for (int r = 0; r < R; ++r)
      for (int v = 0; v < 2; ++v) std::memcpy(out + (i + r) * 2 * kWidth + v * kWidth, &sum[r][v], 64);
  }
}
#else
float widened(std::uint16_t x) {
  const std::uint32_t bits = static_cast<std::uint32_t>(x) << 16;
  float f;
  std::memcpy(&f, &bits, sizeof f);
  return f;
}

void plain_products(const Rows& rows, const std::uint16_t* b, Index panel, Products& out) {
  for (Index i = 0; i < kRows; ++i)
    for (Index v = 0; v < 2; ++v)
      for (Index j = 0; j < kWidth; ++j) {
        float sum = 0;
        for (Index k = 0; k < rows.depth; ++k)
          sum +=
              widened(rows.at[i * rows.depth + k]) * widened(b[v * panel + (k / 2 * kWidth + j) * 2 + k % 2]);
        out[i * 2 * kWidth + v * kWidth + j] = sum;
      }
}
#endif

// Writes one element of C from its sum of products.
[[gnu::always_inline]] inline void finish(const GemmBf16& g, Index i, Index j, float sum) {
  const Index at = i * g.ldc + j;
  float c = sum + (g.accumulate ? g.c[at] : g.bias ? g.bias[j] : 0.f);
  if (g.mask && !(g.mask[at] > 0)) c = 0;
  g.c[at] = g.relu && c < 0 ? 0 : c;
}

// Writes a whole vector of C.
[[gnu::always_inline]] inline void finish_vector(const GemmBf16& g, Index i, Index j, const float* sums) {
  using V = simd::Vec<float>;
  const Index at = i * g.ldc + j;
  V c = simd::load(sums);
  if (g.accumulate)
    c += simd::load(g.c + at);
  else if (g.bias)
    c += simd::load(g.bias + j);
  if (g.mask) c = simd::load(g.mask + at) > V{} ? c : V{};
  simd::store(g.c + at, g.relu ? simd::max(V{}, c) : c);
}

void finish_block(const GemmBf16& g, Index i, Index rows, Index j, Index columns, const float* products) {
  constexpr Index L = simd::kLanes<float>;
  for (Index r = 0; r < rows; ++r, products += 2 * kWidth) {
    Index x = 0;
    for (; x + L <= columns; x += L) finish_vector(g, i + r, j + x, products + x);
    for (; x < columns; ++x) finish(g, i + r, j + x, products[x]);
  }
}

}  // namespace

void pack_bf16(const float* b, Index rows, Index columns, Index row, Index column, std::uint16_t* out) {
  const Index depth = (rows + 31) / 32 * 32;
  for (Index j = 0; j < columns; j += kWidth)
    for (Index i = 0; i < depth; i += 2)
      for (Index x = 0; x < kWidth; ++x)
        for (Index p = 0; p < 2; ++p)
          *out++ = i + p < rows && j + x < columns ? rounded(b[(i + p) * row + (j + x) * column])
                                                   : std::uint16_t{0};
}

void round_bf16(const float* x, Index n, std::uint16_t* out) {
  for (Index i = 0; i < n; ++i) out[i] = rounded(x[i]);
}

void gemm_bf16(const GemmBf16& g) {
  // The panels of B hold all of K; a part of K starts at an offset within each panel.
  const Index panel = (g.k + 31) / 32 * 32 * kWidth;
#if defined(__AVX512BF16__)
  const TileShapes shapes;
  if (g.tiles) _tile_loadconfig(&shapes);
#endif
  Rows rows;
  alignas(64) Products products;
  for (Index i = 0; i < g.m; i += kRows) {
    const Index count = g.m - i < kRows ? g.m - i : kRows;
    for (Index begin = 0; begin == 0 || begin < g.k; begin += kDepth) {
      GemmBf16 part = g;
      const bool last = begin + kDepth >= g.k;
      part.accumulate = g.accumulate || begin > 0;
      part.relu = g.relu && last;
      part.mask = last ? g.mask : nullptr;
      rows.load(g.a + i * g.a_row + begin, g.a_row, count, last ? g.k - begin : kDepth);
      for (Index j = 0; j < g.n; j += 2 * kWidth) {
        const Index columns = g.n - j < 2 * kWidth ? g.n - j : 2 * kWidth;
        const std::uint16_t* b = g.b + j / kWidth * panel + begin * kWidth;
        const Index other = columns > kWidth ? panel : 0;  // the last panel may have no partner
#if defined(__AVX512BF16__)
        (g.tiles ? tile_products : dot_products)(rows, b, other, products);
#else
        plain_products(rows, b, other, products);
#endif
        finish_block(part, i, count, j, columns, products);
      }
    }
  }
#if defined(__AVX512BF16__)
  if (g.tiles) _tile_release();
#endif
}

}  // namespace fieldmark::kernels::FIELDMARK_ISA_NS
