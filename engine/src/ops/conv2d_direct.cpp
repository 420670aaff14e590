#include "ops/conv2d_parts.h"
#include "ops/product.h"

namespace fieldmark::detail {
namespace {

constexpr Index kDepth = 512;  // pixels that a product for dW sums over: as deep as stays in L2

Index radius(const ConvGeometry& g) { return g.k / 2; }
Index rows(const ConvGeometry& g) { return g.n * g.h; }
Index padded_w(const ConvGeometry& g) { return g.w + 2 * radius(g); }
Index padded_h(const ConvGeometry& g) { return g.h + 2 * radius(g); }

// x [N, H, W, C] with a border of zeros, which every window then stays inside.
template <class T>
const T* with_border(Tape<T>& tape, const ConvGeometry& g, const T* x, const T* mask) {
  const Index row = padded_w(g) * g.c, inner = g.w * g.c;
  T* out = tape.scratch(g.n * padded_h(g) * row);
  parallel_for(g.n * padded_h(g), 16, [&](Index begin, Index end) {
    for (Index p = begin; p < end; ++p) {
      T* to = out + p * row;
      const Index image = p / padded_h(g), y = p % padded_h(g) - radius(g);
      if (y < 0 || y >= g.h) {
        std::fill_n(to, row, T(0));
        continue;
      }
      const Index from = (image * g.h + y) * inner;
      std::fill_n(to, radius(g) * g.c, T(0));
      T* middle = to + radius(g) * g.c;
      if (mask)
        for (Index i = 0; i < inner; ++i) middle[i] = mask[from + i] > 0 ? x[from + i] : T(0);
      else
        std::copy_n(x + from, inner, middle);
      std::fill_n(middle + inner, radius(g) * g.c, T(0));
    }
  });
  return out;
}

}  // namespace

// A row of the result is one product: the windows of its pixels (K segments of K * channels numbers) times
// the weights.
template <class T>
const T* direct_convolve(Tape<T>& tape, const ConvGeometry& g, const Convolution<T>& c) {
  using namespace kernels;
  const T* padded = with_border(tape, g, c.x, c.mask);
  const T* weights = packed(tape, c.w, g.k * g.k * g.c, g.o, g.o, Index{1});
  const auto run = FIELDMARK_KERNEL(gemm<T>);
  parallel_for(rows(g), 4, [&](Index begin, Index end) {
    for (Index row = begin; row < end; ++row) {
      const Index image = row / g.h, i = row % g.h;
      run({.m = g.w,
           .n = g.o,
           .k = g.k * g.c,
           .segments = g.k,
           .a = padded + (image * padded_h(g) + i) * padded_w(g) * g.c,
           .a_row = g.c,
           .a_segment = padded_w(g) * g.c,
           .b = weights,
           .c = c.y + row * g.w * g.o,
           .ldc = g.o,
           .bias = c.bias,
           .accumulate = c.accumulate,
           .relu = c.relu});
    }
  });
  return padded;
}

// dW[u, (v, c), o] = sum over pixels of x[pixel + (u, v), c] dY[pixel, o]: a few rows of dY at a time are
// packed once and multiplied with the input rows that each u shifts to.
template <class T>
void direct_weight_gradient(Tape<T>& tape, const ConvGeometry& g, const T* padded, const T* dy, const T* mask,
                            T* dw) {
  const Index size = g.k * g.k * g.c * g.o, together = std::max<Index>(1, kDepth / std::max<Index>(g.w, 1));
  const Index pixels = rows(g) * g.w, panel = panel_width<T>(g.o);
  const T* d = packed(tape, dy, pixels, g.o, g.o, Index{1}, mask);
  sharded_sum(tape, rows(g), 64, dw, size, [&](Index begin, Index end, T* to) {
    using namespace kernels;
    const auto run = FIELDMARK_KERNEL(gemm<T>);
    for (Index row = begin; row < end;) {
      const Index image = row / g.h, i = row % g.h, count = std::min({together, end - row, g.h - i});
      for (Index u = 0; u < g.k; ++u)
        run({.m = g.k * g.c,
             .n = g.o,
             .k = g.w,
             .segments = count,
             .a = padded + (image * padded_h(g) + i + u) * padded_w(g) * g.c,
             .a_row = 1,
             .a_col = g.c,
             .a_segment = padded_w(g) * g.c,
             .b = d + row * g.w * panel,
             .b_panel = pixels * panel,
             .c = to + u * g.k * g.c * g.o,
             .ldc = g.o,
             .accumulate = true});
      row += count;
    }
  });
}

#define FIELDMARK_INSTANTIATE(T)                                                           \
  template const T* direct_convolve(Tape<T>&, const ConvGeometry&, const Convolution<T>&); \
  template void direct_weight_gradient(Tape<T>&, const ConvGeometry&, const T*, const T*, const T*, T*);
FIELDMARK_INSTANTIATE(float)
FIELDMARK_INSTANTIATE(double)

}  // namespace fieldmark::detail
