// Convolutions with few outputs, as at either end of a network on images, whose outputs would leave most of a
// vector empty. y is vectorised over pixels and dW over elements of the window instead. Every sum keeps the
// order of conv2d_direct.cpp, so that both ways give the same bits.
#include "kernels/few_outputs.h"
#include "ops/conv2d_parts.h"
#include "ops/product.h"

namespace fieldmark::detail {
namespace {

// x [n, h, w, c] as planes [n, h + border, c, line], with 0 where the mask is not positive and beyond the
// image.
template <class T>
const T* planes_of(Tape<T>& tape, const ConvGeometry& g, const T* x, const T* mask, Index line) {
  using namespace kernels;
  const Index high = g.padded_h(), size = g.c * line;
  const auto spread = FIELDMARK_KERNEL(pixel_planes<T>);
  T* out = tape.scratch(g.n * high * size);
  parallel_for(g.n * high, 16, [=](Index begin, Index end) {
    for (Index p = begin; p < end; ++p) {
      T* to = out + p * size;
      const Index image = p / high, y = p % high - g.padding;
      std::fill_n(to, size, T(0));
      if (y < 0 || y >= g.h) continue;
      const Index from = (image * g.h + y) * g.w * g.c;
      spread(x + from, mask ? mask + from : nullptr, g.w, g.c, line, to + g.padding);
    }
  });
  return out;
}

}  // namespace

// Windows of 1 do not share the planes with neighbours, and a narrow image leaves most lanes empty.
template <class T>
bool few_outputs_pay(const ConvGeometry& g) {
  using namespace kernels;
  return g.same() && g.k > 1 && 2 * g.w >= panel_width<T>(1) && g.o > 0 &&
         g.o <= FIELDMARK_KERNEL(most_few_outputs<T>)();
}

template <class T>
void few_convolve(Tape<T>& tape, const ConvGeometry& g, const Convolution<T>& c) {
  using namespace kernels;
  const Index line = whole_row<T>(g.w) + g.k - 1, high = g.padded_h();
  const T* planes = planes_of(tape, g, c.x, c.mask, line);
  const auto run = FIELDMARK_KERNEL(few_outputs<T>);
  parallel_for(g.n * g.h, 4, [&](Index begin, Index end) {
    for (Index row = begin; row < end; ++row)
      run({.pixels = g.w,
           .channels = g.c,
           .outputs = g.o,
           .window = g.k,
           .x = planes + (row / g.h * high + row % g.h) * g.c * line,
           .row = g.c * line,
           .plane = line,
           .w = c.w,
           .bias = c.bias,
           .accumulate = c.accumulate,
           .relu = c.relu,
           .y = c.y + row * g.w * g.o});
  });
}

// dW[u, (v, c), o] = sum over pixels of x[pixel + (u, v), c] dY[pixel, o], transposed: for each row of dY and
// each u, a product of dY^T [o, pixels] with the windows [pixels, K channels], which overlap in the bordered
// x.
template <class T>
void few_weight_gradient(Tape<T>& tape, const ConvGeometry& g, const T* x, const T* dy, const T* mask,
                         T* dw) {
  const T* bordered = with_border(tape, g, x, static_cast<const T*>(nullptr));
  const T* d = masked(tape, dy, mask, g.pixels() * g.o);
  const Index columns = g.k * g.c, width = whole_row<T>(columns), high = g.padded_h(),
              line = g.padded_w() * g.c;
  T* sums = tape.scratch(g.k * g.o * width);  // [K, o, K channels]
  const auto each = [&](auto&& f) {
    for (Index u = 0; u < g.k; ++u)
      for (Index o = 0; o < g.o; ++o)
        for (Index j = 0; j < width; ++j) f((u * g.o + o) * width + j, j, (u * columns + j) * g.o + o);
  };
  each([&](Index at, Index j, Index to) { sums[at] = j < columns ? dw[to] : T(0); });
  sharded_sum(tape, g.n * g.h, 64, sums, g.k * g.o * width, [&](Index begin, Index end, T* to) {
    using namespace kernels;
    const auto run = FIELDMARK_KERNEL(gemm<T>);
    for (Index row = begin; row < end; ++row)
      for (Index u = 0; u < g.k; ++u)
        run({.m = g.o,
             .n = width,
             .k = g.w,
             .a = d + row * g.w * g.o,
             .a_row = 1,
             .a_col = g.o,
             .b = bordered + (row / g.h * high + row % g.h + u) * line,
             .b_row = g.c,
             .b_panel = panel_width<T>(width),
             .c = to + u * g.o * width,
             .ldc = width,
             .accumulate = true});
  });
  each([&](Index at, Index j, Index to) {
    if (j < columns) dw[to] = sums[at];
  });
}

#define FIELDMARK_INSTANTIATE(T)                                                    \
  template bool few_outputs_pay<T>(const ConvGeometry&);                            \
  template void few_convolve(Tape<T>&, const ConvGeometry&, const Convolution<T>&); \
  template void few_weight_gradient(Tape<T>&, const ConvGeometry&, const T*, const T*, const T*, T*);
FIELDMARK_INSTANTIATE(float)
FIELDMARK_INSTANTIATE(double)
#undef FIELDMARK_INSTANTIATE

}  // namespace fieldmark::detail
