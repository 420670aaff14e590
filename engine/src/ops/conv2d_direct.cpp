#include "kernels/pool.h"
#include "ops/chunks.h"
#include "ops/conv2d_parts.h"
#include "ops/product.h"

namespace fieldmark::detail {
namespace {

constexpr Index kDepth = 512;  // pixels that a product for dW sums over: they fit into L2

Index rows(const ConvGeometry& g) { return g.n * g.out_h(); }

}  // namespace

template <class T>
void bias_gradient(Tape<T>& tape, const T* dy, const T* mask, Index pixels, Index channels, T* db) {
  using namespace kernels;
  const Index block = row_grain(channels), chunks = (pixels + block - 1) / block;
  auto* sums = tape.template scratch<double>(chunks * channels);
  const auto sum = FIELDMARK_KERNEL(channel_sums<T>);
  parallel_for(pixels, block, [&](Index begin, Index end) {
    const Index at = begin * channels;
    sum(dy + at, mask ? mask + at : nullptr, end - begin, channels, sums + begin / block * channels);
  });
  for (Index o = 0; o < channels; ++o) db[o] += static_cast<T>(channel_total(sums, chunks, channels, o));
}

template <class T>
const T* with_border(Tape<T>& tape, const ConvGeometry& g, const T* x, const T* mask) {
  const Index row = g.padded_w() * g.c, inner = g.w * g.c, border = g.padding * g.c;
  if (border == 0 && !mask) return x;
  const Index size = g.n * g.padded_h() * row, vector = panel_width<T>(1);
  T* out = tape.scratch(size + vector);
  std::fill_n(out + size, vector, T(0));
  parallel_for(g.n * g.padded_h(), 16, [&](Index begin, Index end) {
    for (Index p = begin; p < end; ++p) {
      T* to = out + p * row;
      const Index image = p / g.padded_h(), y = p % g.padded_h() - g.padding;
      if (y < 0 || y >= g.h) {
        std::fill_n(to, row, T(0));
        continue;
      }
      const Index from = (image * g.h + y) * inner;
      std::fill_n(to, border, T(0));
      T* middle = to + border;
      if (mask)
        for (Index i = 0; i < inner; ++i) middle[i] = mask[from + i] > 0 ? x[from + i] : T(0);
      else
        std::copy_n(x + from, inner, middle);
      std::fill_n(middle + inner, border, T(0));
    }
  });
  return out;
}

// A row of the result is one product: the windows of its pixels (K segments of K * channels elements) times
// the weights.
template <class T>
void direct_products(Tape<T>& tape, const ConvGeometry& g, const T* padded, const Convolution<T>& c) {
  using namespace kernels;
  const T* weights = packed(tape, c.w, g.k * g.k * g.c, g.o, g.o, Index{1});
  const auto run = FIELDMARK_KERNEL(gemm<T>);
  parallel_for(rows(g), 4, [&](Index begin, Index end) {
    for (Index row = begin; row < end; ++row) {
      const Index image = row / g.out_h(), i = row % g.out_h() * g.stride;
      run({.m = g.out_w(),
           .n = g.o,
           .k = g.k * g.c,
           .segments = g.k,
           .a = padded + (image * g.padded_h() + i) * g.padded_w() * g.c,
           .a_row = g.stride * g.c,
           .a_segment = g.padded_w() * g.c,
           .b = weights,
           .c = c.y + row * g.out_w() * g.o,
           .ldc = g.o,
           .bias = c.bias,
           .accumulate = c.accumulate,
           .relu = c.relu});
    }
  });
}

template <class T>
const T* direct_convolve(Tape<T>& tape, const ConvGeometry& g, const Convolution<T>& c) {
  const T* padded = with_border(tape, g, c.x, c.mask);
  direct_products(tape, g, padded, c);
  return padded;
}

// dW[u, (v, c), o] = sum over pixels of x[pixel + (u, v), c] dY[pixel, o]: packs a few rows of
// dY at a time and multiplies them with the input rows that each u shifts to.
template <class T>
void direct_weight_gradient(Tape<T>& tape, const ConvGeometry& g, const T* bordered, const T* dy,
                            const T* mask, T* dw) {
  const Index size = g.k * g.k * g.c * g.o,
              together = std::max<Index>(1, kDepth / std::max<Index>(g.out_w(), 1));
  sharded_sum(tape, rows(g), 64, dw, size, [&](Index begin, Index end, T* to) {
    using namespace kernels;
    const auto run = FIELDMARK_KERNEL(gemm<T>);
    for (Index row = begin; row < end;) {
      const Index image = row / g.out_h(), i = row % g.out_h(),
                  count = std::min({together, end - row, g.out_h() - i}), first = row * g.out_w() * g.o;
      T* d = workspace<T>(panels_size<T>(count * g.out_w(), g.o));
      pack(dy + first, count * g.out_w(), g.o, g.o, Index{1}, mask ? mask + first : nullptr, d);
      for (Index u = 0; u < g.k; ++u)
        run({.m = g.k * g.c,
             .n = g.o,
             .k = g.out_w(),
             .segments = count,
             .a = bordered + (image * g.padded_h() + i * g.stride + u) * g.padded_w() * g.c,
             .a_row = 1,
             .a_col = g.stride * g.c,
             .a_segment = g.stride * g.padded_w() * g.c,
             .b = d,
             .c = to + u * g.k * g.c * g.o,
             .ldc = g.o,
             .accumulate = true});
      row += count;
    }
  });
}

template <class T>
const T* masked(Tape<T>& tape, const T* dy, const T* mask, Index size) {
  if (!mask) return dy;
  using namespace kernels;
  T* out = tape.scratch(size);
  const auto copy = FIELDMARK_KERNEL(pad_rows<T>);
  parallel_for(size, 1 << 15, [=](Index begin, Index end) {
    copy(dy + begin, 1, end - begin, mask + begin, end - begin, out + begin);
  });
  return out;
}

// dX[i s + u - p, j s + v - p, c] += sum over o of dY[i, j, o] w[u, v, c, o]: for each pixel, a row of
// dY times w[u] gives K * channels contiguous elements of a row of dX. A chunk owns rows of dX with their
// border, gathers every row of dY that touches them, and drops the border.
template <class T>
void direct_input_gradient(Tape<T>& tape, const ConvGeometry& g, const T* w, const T* dy, const T* mask,
                           bool accumulate, T* dx) {
  constexpr Index kRows = 8;
  const Index run_length = g.k * g.c, line = g.padded_w() * g.c, width = g.out_w(), plane = g.out_h() * width;
  const T* d = masked(tape, dy, mask, g.pixels() * g.o);
  const Index panels = panels_size<T>(g.o, run_length);
  T* weights = tape.scratch(g.k * panels);
  for (Index u = 0; u < g.k; ++u)
    pack(w + u * run_length * g.o, g.o, run_length, Index{1}, g.o, static_cast<const T*>(nullptr),
         weights + u * panels);
  const Index chunks = (g.n * g.h + kRows - 1) / kRows, size = line + width * run_length;
  T* buffers = tape.scratch(chunks * size);
  parallel_for(g.n * g.h, kRows, [&](Index begin, Index end) {
    using namespace kernels;
    const auto run = FIELDMARK_KERNEL(gemm<T>);
    T *sum = buffers + begin / kRows * size, *product = sum + line;
    for (Index row = begin; row < end; ++row) {
      const Index image = row / g.h, r = row % g.h + g.padding;
      std::fill_n(sum, line, T(0));
      for (Index u = r % g.stride; u < std::min(g.k, r + 1); u += g.stride) {
        const Index i = (r - u) / g.stride;
        if (i >= g.out_h()) continue;
        run({.m = width,
             .n = run_length,
             .k = g.o,
             .a = d + (image * plane + i * width) * g.o,
             .a_row = g.o,
             .b = weights + u * panels,
             .c = product,
             .ldc = run_length});
        for (Index j = 0; j < width; ++j)
          for (Index k = 0; k < run_length; ++k) sum[j * g.stride * g.c + k] += product[j * run_length + k];
      }
      T* to = dx + row * g.w * g.c;
      const T* from = sum + g.padding * g.c;
      for (Index k = 0; k < g.w * g.c; ++k) to[k] = accumulate ? to[k] + from[k] : from[k];
    }
  });
}

#define FIELDMARK_INSTANTIATE(T)                                                                         \
  template void bias_gradient(Tape<T>&, const T*, const T*, Index, Index, T*);                           \
  template const T* with_border(Tape<T>&, const ConvGeometry&, const T*, const T*);                      \
  template void direct_products(Tape<T>&, const ConvGeometry&, const T*, const Convolution<T>&);         \
  template const T* direct_convolve(Tape<T>&, const ConvGeometry&, const Convolution<T>&);               \
  template void direct_weight_gradient(Tape<T>&, const ConvGeometry&, const T*, const T*, const T*, T*); \
  template const T* masked(Tape<T>&, const T*, const T*, Index);                                         \
  template void direct_input_gradient(Tape<T>&, const ConvGeometry&, const T*, const T*, const T*, bool, T*);
FIELDMARK_INSTANTIATE(float)
FIELDMARK_INSTANTIATE(double)
#undef FIELDMARK_INSTANTIATE

}  // namespace fieldmark::detail
