#include "kernels/winograd.h"

#include "kernels/channels.h"

namespace fieldmark::kernels {
namespace {

// Points of evaluation p = 1 / sqrt 2 and q = sqrt 2: p^2, q^2, p^2 q^2 and p^2 + q^2 are exact in binary.
template <class T>
constexpr T kP = T(0.70710678118654752440);
template <class T>
constexpr T kQ = T(1.41421356237309504880);

// Each transform maps `from` inputs along one axis to `to` outputs, with rows in the order of the points 0,
// p, -p, q, -q, infinity. V is a vector or a scalar of T.

// B^T: row i holds the coefficients of prod_{j != i} (z - a_j), the last those of the product over all
// points.
struct WindowLine {
  static constexpr int from = 6, to = 6;
  template <class T, class V>
  [[gnu::always_inline]] static void run(const V* d, V* t) {
    const V even1 = d[4] - T(2) * d[2], odd1 = kP<T> * (d[3] - T(2) * d[1]);
    const V even2 = d[4] - T(0.5) * d[2], odd2 = kQ<T> * (d[3] - T(0.5) * d[1]);
    t[0] = d[0] - T(2.5) * d[2] + d[4];
    t[1] = even1 + odd1;
    t[2] = even1 - odd1;
    t[3] = even2 + odd2;
    t[4] = even2 - odd2;
    t[5] = d[1] - T(2.5) * d[3] + d[5];
  }
};

// A: row i holds 1, a_i, a_i^2 and a_i^3.
struct TileLine {
  static constexpr int from = 4, to = 6;
  template <class T, class V>
  [[gnu::always_inline]] static void run(const V* d, V* t) {
    const V even1 = d[0] + T(0.5) * d[2], odd1 = kP<T> * (d[1] + T(0.5) * d[3]);
    const V even2 = d[0] + T(2) * d[2], odd2 = kQ<T> * (d[1] + T(2) * d[3]);
    t[0] = d[0];
    t[1] = even1 + odd1;
    t[2] = even1 - odd1;
    t[3] = even2 + odd2;
    t[4] = even2 - odd2;
    t[5] = d[3];
  }
};

// A^T.
struct OutputLine {
  static constexpr int from = 6, to = 4;
  template <class T, class V>
  [[gnu::always_inline]] static void run(const V* m, V* y) {
    const V even1 = m[1] + m[2], odd1 = kP<T> * (m[1] - m[2]);
    const V even2 = m[3] + m[4], odd2 = kQ<T> * (m[3] - m[4]);
    y[0] = m[0] + even1 + even2;
    y[1] = odd1 + odd2;
    y[2] = T(0.5) * even1 + T(2) * even2;
    y[3] = T(0.5) * odd1 + T(2) * odd2 + m[5];
  }
};

// G: row i holds 1, a_i, a_i^2 over prod_{j != i} (a_i - a_j), which is 1, -3/2, -3/2, 6, 6, 1.
struct WeightLine {
  static constexpr int from = 3, to = 6;
  template <class T, class V>
  [[gnu::always_inline]] static void run(const V* g, V* t) {
    const V even1 = T(-2.0 / 3) * (g[0] + T(0.5) * g[2]), odd1 = T(-2.0 / 3) * kP<T> * g[1];
    const V even2 = T(1.0 / 6) * (g[0] + T(2) * g[2]), odd2 = T(1.0 / 6) * kQ<T> * g[1];
    t[0] = g[0];
    t[1] = even1 + odd1;
    t[2] = even1 - odd1;
    t[3] = even2 + odd2;
    t[4] = even2 - odd2;
    t[5] = g[2];
  }
};

// G^T.
struct GradientLine {
  static constexpr int from = 6, to = 3;
  template <class T, class V>
  [[gnu::always_inline]] static void run(const V* m, V* g) {
    const V even1 = T(-2.0 / 3) * (m[1] + m[2]), odd1 = T(-2.0 / 3) * kP<T> * (m[1] - m[2]);
    const V even2 = T(1.0 / 6) * (m[3] + m[4]), odd2 = T(1.0 / 6) * kQ<T> * (m[3] - m[4]);
    g[0] = m[0] + even1 + even2;
    g[1] = odd1 + odd2;
    g[2] = T(0.5) * even1 + T(2) * even2 + m[5];
  }
};

// Calls store(i, j, (L X L^T)[i, j]) for X[i, j] = load(i, j).
template <class Line, class T, class V, class Load, class Store>
[[gnu::always_inline]] inline void both_axes(Load load, Store store) {
  V half[Line::to][Line::from];
#pragma GCC unroll 6
  for (int j = 0; j < Line::from; ++j) {
    V in[Line::from], out[Line::to];
#pragma GCC unroll 6
    for (int i = 0; i < Line::from; ++i) in[i] = load(i, j);
    Line::template run<T>(in, out);
#pragma GCC unroll 6
    for (int i = 0; i < Line::to; ++i) half[i][j] = out[i];
  }
#pragma GCC unroll 6
  for (int i = 0; i < Line::to; ++i) {
    V out[Line::to];
    Line::template run<T>(half[i], out);
#pragma GCC unroll 6
    for (int j = 0; j < Line::to; ++j) store(i, j, out[j]);
  }
}

constexpr Index smaller(Index a, Index b) { return a < b ? a : b; }

// Calls f with the number of a tile within `count`, the offset of its first pixel from that of the image, its
// row, its column, and the first pixel of the image.
template <class T, class F>
[[gnu::always_inline]] inline void for_tiles(const WinogradTiles<T>& x, F f) {
  const Index down = (x.h + kWinogradTile - 1) / kWinogradTile,
              across = (x.w + kWinogradTile - 1) / kWinogradTile;
  for (Index t = 0; t < x.count; ++t) {
    const Index tile = x.first + t, line = tile / across;
    f(t, line / down * x.h * x.w, line % down * kWinogradTile, tile % across * kWinogradTile);
  }
}

// Calls f(V{}, c, offset of element [row, c] of the first matrix) for the channels of a row of matrices in
// panels; fills the rest of the last panel with 0.
template <class T, class F>
[[gnu::always_inline]] inline void for_row(const WinogradMatrices<T>& to, Index row, Index channels, F f) {
  T* at = to.data + row * to.panel;
  for (Index first = 0; first < channels; first += to.panel, at += to.distance) {
    const Index width = smaller(to.panel, channels - first);
    for_channels<T>(width, [=](auto zero, Index c) { f(zero, first + c, at + c); });
    for_channels<T>(to.panel - width, [=](auto zero, Index c) {
      for (Index k = 0; k < kWinogradProducts; ++k) store_as(at + k * to.stride + width + c, zero);
    });
  }
}

struct Range {
  Index first, last;
};
// Returns the i of [0, count) for which start + i lies in [0, extent).
constexpr Range inside_of(Index start, Index count, Index extent) {
  return {start < 0 ? -start : 0, smaller(count, extent - start)};
}

// A tile's square, Line::from pixels a side: where it begins, and the part of it within the image.
struct Square {
  Index tile, begin;
  Range rows, columns;
};

// Transforms a square within an image. Load: of V at an offset from the image's data.
template <class Line, class T, class Load>
[[gnu::always_inline]] inline void transform_inside(const WinogradTiles<T>& x, const WinogradMatrices<T>& to,
                                                    const Square& at, Load load) {
  const Index pixel = x.channels, line = x.w * pixel, begin = at.begin;
  for_row(to, at.tile, pixel, [=](auto zero, Index c, T* out) {
    using V = decltype(zero);
    both_axes<Line, T, V>([=](int i, int j) { return load(V{}, begin + c + i * line + j * pixel); },
                          [=](int i, int j, V v) { store_as(out + (i * 6 + j) * to.stride, v); });
  });
}

// Transforms a square of which a part may lie outside the image, where it is 0.
// Rolled loops: with sanitizers, 36 inline tests of the place take minutes to compile.
template <class Line, class T, class Load>
void transform_at_edge(const WinogradTiles<T>& x, const WinogradMatrices<T>& to, const Square& at,
                       Load load) {
  const Index pixel = x.channels, line = x.w * pixel;
  for_row(to, at.tile, pixel, [=](auto zero, Index c, T* out) {
    using V = decltype(zero);
    V square[Line::from][Line::from] = {};
#pragma GCC unroll 1
    for (Index i = at.rows.first; i < at.rows.last; ++i)
#pragma GCC unroll 1
      for (Index j = at.columns.first; j < at.columns.last; ++j)
        square[i][j] = load(V{}, at.begin + c + i * line + j * pixel);
    both_axes<Line, T, V>([&](int i, int j) { return square[i][j]; },
                          [=](int i, int j, V v) { store_as(out + (i * 6 + j) * to.stride, v); });
  });
}

// Transforms the square of each tile, which begins `border` pixels before the tile. A masked element counts
// as 0. Each case has a loop of its own: a branch within the loop over channels costs a twentieth.
template <class Line, Index border, class T>
void transform(const WinogradTiles<T>& x, const WinogradMatrices<T>& to) {
  const auto plain = [x](auto zero, Index k) { return load_as<decltype(zero)>(x.data + k); };
  const auto masked = [x](auto zero, Index k) {
    using V = decltype(zero);
    return load_as<V>(x.mask + k) > V{} ? load_as<V>(x.data + k) : V{};
  };
  for_tiles(x, [=](Index t, Index image, Index row, Index column) {
    const Index top = row - border, left = column - border;
    const Square at{.tile = t,
                    .begin = (image + top * x.w + left) * x.channels,
                    .rows = inside_of(top, Line::from, x.h),
                    .columns = inside_of(left, Line::from, x.w)};
    const bool inside =
        at.rows.last - at.rows.first == Line::from && at.columns.last - at.columns.first == Line::from;
    if (inside && !x.mask) return transform_inside<Line>(x, to, at, plain);
    if (inside) return transform_inside<Line>(x, to, at, masked);
    if (!x.mask) return transform_at_edge<Line>(x, to, at, plain);
    transform_at_edge<Line>(x, to, at, masked);
  });
}

}  // namespace

namespace FIELDMARK_ISA_NS {

template <class T>
void winograd_windows(const WinogradTiles<T>& x, const WinogradMatrices<T>& to) {
  transform<WindowLine, 1>(x, to);
}

template <class T>
void winograd_tiles(const WinogradTiles<T>& dy, const WinogradMatrices<T>& to) {
  transform<TileLine, 0>(dy, to);
}

template <class T>
void winograd_weights(const T* w, Index c_in, Index c_out, Index first, Index count,
                      const WinogradMatrices<T>& to) {
  for (Index row = first; row < first + count; ++row)
    for_row(to, row, c_out, [=](auto zero, Index c, T* at) {
      using V = decltype(zero);
      const T* from = w + row * c_out + c;
      both_axes<WeightLine, T, V>([=](int i, int j) { return load_as<V>(from + (i * 3 + j) * c_in * c_out); },
                                  [=](int i, int j, V v) { store_as(at + (i * 6 + j) * to.stride, v); });
    });
}

template <class T>
void winograd_outputs(const WinogradTiles<T>& x, const WinogradMatrices<const T>& m,
                      const WinogradOutput<T>& out) {
  const Index pixel = x.channels, line = x.w * pixel;
  for_tiles(x, [=](Index t, Index image, Index row, Index column) {
    const Index rows = x.h - row, columns = x.w - column;
    T* y = out.y + (image + row * x.w + column) * pixel;
    for_channels<T>(pixel, [=](auto zero, Index c) {
      using V = decltype(zero);
      const T* from = m.data + t * m.panel + c;
      const V bias = out.bias ? load_as<V>(out.bias + c) : V{};
      both_axes<OutputLine, T, V>([=](int i, int j) { return load_as<V>(from + (i * 6 + j) * m.stride); },
                                  [=](int i, int j, V v) {
                                    if (i >= rows || j >= columns) return;
                                    T* to = y + i * line + j * pixel + c;
                                    v += out.accumulate ? load_as<V>(to) : bias;
                                    // Zero comes first: NaN stays NaN.
                                    store_as(to, out.relu ? simd::max(V{}, v) : v);
                                  });
    });
  });
}

template <class T>
void winograd_weight_gradient(const WinogradMatrices<const T>& m, Index c_in, Index c_out, T* dw) {
  const Index plane = c_in * c_out;
  for (Index row = 0; row < c_in; ++row)
    for_channels<T>(c_out, [=](auto zero, Index c) {
      using V = decltype(zero);
      const T* from = m.data + row * m.panel + c;
      both_axes<GradientLine, T, V>([=](int i, int j) { return load_as<V>(from + (i * 6 + j) * m.stride); },
                                    [=](int i, int j, V v) {
                                      T* to = dw + (i * 3 + j) * plane + row * c_out + c;
                                      store_as(to, load_as<V>(to) + v);
                                    });
    });
}

#define FIELDMARK_INSTANTIATE(T)                                                                    \
  template void winograd_windows(const WinogradTiles<T>&, const WinogradMatrices<T>&);              \
  template void winograd_tiles(const WinogradTiles<T>&, const WinogradMatrices<T>&);                \
  template void winograd_weights(const T*, Index, Index, Index, Index, const WinogradMatrices<T>&); \
  template void winograd_outputs(const WinogradTiles<T>&, const WinogradMatrices<const T>&,         \
                                 const WinogradOutput<T>&);                                         \
  template void winograd_weight_gradient(const WinogradMatrices<const T>&, Index, Index, T*);
FIELDMARK_INSTANTIATE(float)
FIELDMARK_INSTANTIATE(double)
#undef FIELDMARK_INSTANTIATE

}  // namespace FIELDMARK_ISA_NS
}  // namespace fieldmark::kernels
