#include <fieldmark/engine/ops/conv2d.h>

#include "ops/product.h"

namespace fieldmark {
namespace {

constexpr Index kDepth = 512;  // pixels that a product for dW sums over: as deep as stays in L2

struct Geometry {
  Index n, h, w, c, o, k;
  Index r() const { return k / 2; }
  Index rows() const { return n * h; }
  Index padded_w() const { return w + 2 * r(); }
  Index padded_h() const { return h + 2 * r(); }
};

// x [N, H, W, C] with a border of zeros, which every window then stays inside.
template <class T>
T* with_border(Tape<T>& tape, const T* x, const Geometry& g, Index channels, const T* mask = nullptr) {
  const Index row = g.padded_w() * channels, inner = g.w * channels;
  T* out = tape.scratch(g.n * g.padded_h() * row);
  parallel_for(g.n * g.padded_h(), 16, [&](Index begin, Index end) {
    for (Index p = begin; p < end; ++p) {
      T* to = out + p * row;
      const Index image = p / g.padded_h(), y = p % g.padded_h() - g.r();
      if (y < 0 || y >= g.h) {
        std::fill_n(to, row, T(0));
        continue;
      }
      const Index from = (image * g.h + y) * inner;
      std::fill_n(to, g.r() * channels, T(0));
      T* middle = to + g.r() * channels;
      if (mask)
        for (Index i = 0; i < inner; ++i) middle[i] = mask[from + i] > 0 ? x[from + i] : T(0);
      else
        std::copy_n(x + from, inner, middle);
      std::fill_n(middle + inner, g.r() * channels, T(0));
    }
  });
  return out;
}

// A row of the result is one product: the windows of its pixels (K segments of K * channels numbers) times
// the weights.
template <class T>
void convolve(const T* padded, const T* weights, const Geometry& g, Index in, Index out, const T* bias,
              bool relu, bool accumulate, T* y) {
  using namespace kernels;
  const auto run = FIELDMARK_KERNEL(gemm<T>);
  parallel_for(g.rows(), 4, [&](Index begin, Index end) {
    for (Index row = begin; row < end; ++row) {
      const Index image = row / g.h, i = row % g.h;
      run({.m = g.w,
           .n = out,
           .k = g.k * in,
           .segments = g.k,
           .a = padded + (image * g.padded_h() + i) * g.padded_w() * in,
           .a_row = in,
           .a_segment = g.padded_w() * in,
           .b = weights,
           .c = y + row * g.w * out,
           .ldc = out,
           .bias = bias,
           .accumulate = accumulate,
           .relu = relu});
    }
  });
}

// dW[u, (v, c), o] = sum over pixels of x[pixel + (u, v), c] dY[pixel, o]: a few rows of dY at a time are
// packed once and multiplied with the input rows that each u shifts to.
template <class T>
void weight_gradient(Tape<T>& tape, const T* padded, const T* dy, const T* mask, const Geometry& g, T* dw) {
  const Index size = g.k * g.k * g.c * g.o, together = std::max<Index>(1, kDepth / std::max<Index>(g.w, 1));
  const Index pixels = g.rows() * g.w, panel = detail::panel_width<T>(g.o);
  const T* d = detail::packed(tape, dy, pixels, g.o, g.o, Index{1}, mask);
  detail::sharded_sum(tape, g.rows(), 64, dw, size, [&](Index begin, Index end, T* to) {
    using namespace kernels;
    const auto run = FIELDMARK_KERNEL(gemm<T>);
    for (Index row = begin; row < end;) {
      const Index image = row / g.h, i = row % g.h, rows = std::min({together, end - row, g.h - i});
      for (Index u = 0; u < g.k; ++u)
        run({.m = g.k * g.c,
             .n = g.o,
             .k = g.w,
             .segments = rows,
             .a = padded + (image * g.padded_h() + i + u) * g.padded_w() * g.c,
             .a_row = 1,
             .a_col = g.c,
             .a_segment = g.padded_w() * g.c,
             .b = d + row * g.w * panel,
             .b_panel = pixels * panel,
             .c = to + u * g.k * g.c * g.o,
             .ldc = g.o,
             .accumulate = true});
      row += rows;
    }
  });
}

// w'[u, v, o, c] = w[K - 1 - u, K - 1 - v, c, o]: the weights of the convolution that takes dY to dX.
template <class T>
T* flipped(Tape<T>& tape, const T* w, const Geometry& g) {
  const Index taps = g.k * g.k;
  T* out = tape.scratch(taps * g.c * g.o);
  for (Index t = 0; t < taps; ++t)
    for (Index c = 0; c < g.c; ++c)
      for (Index o = 0; o < g.o; ++o) out[((taps - 1 - t) * g.o + o) * g.c + c] = w[(t * g.c + c) * g.o + o];
  return out;
}

Geometry geometry(const Shape& x, const Shape& w, const Shape& b) {
  check_rank("conv2d", "x", x, 4, "[N, H, W, C]");
  check_rank("conv2d", "w", w, 4, "[K, K, C, O]");
  check_rank("conv2d", "b", b, 1, "[O]");
  check_extent("conv2d", "w", w, 1, w[0], "a square window");
  if (w[0] % 2 == 0)
    throw ShapeError("[conv2d] w: axis 0 must be odd (a centred window), got shape " + w.str());
  check_extent("conv2d", "w", w, 2, x[3], "the channels of x, whose shape is " + x.str());
  check_extent("conv2d", "b", b, 0, w[3], "the outputs of w, whose shape is " + w.str());
  return {x[0], x[1], x[2], x[3], w[3], w[0]};
}

}  // namespace

template <class T>
Var<T> conv2d(Var<T> x, Var<T> w, Var<T> b, Activation activation) {
  const Geometry g = geometry(x.shape(), w.shape(), b.shape());
  const bool relu = activation == Activation::relu;
  Tape<T>& tape = x.tape();
  T* y = nullptr;
  const Var<T> out = tape.output({g.n, g.h, g.w, g.o}, &y, {x, w, b});
  const T* padded = with_border(tape, x.value(), g, g.c);
  const T* weights = detail::packed(tape, w.value(), g.k * g.k * g.c, g.o, g.o, Index{1});
  convolve(padded, weights, g, g.c, g.o, b.value(), relu, false, y);

  // dZ = dY through the ReLU; db sums it, dW correlates it with x, dX convolves it with the flipped weights.
  tape.on_backward(out, [=](const T* dy) {
    Tape<T>& t = x.tape();
    const T* mask = relu ? y : nullptr;
    if (T* db = b.grad_acc())
      for (Index p = 0; p < g.rows() * g.w; ++p)
        for (Index o = 0; o < g.o; ++o) db[o] += !mask || mask[p * g.o + o] > 0 ? dy[p * g.o + o] : T(0);
    if (T* dw = w.grad_acc()) weight_gradient(t, padded, dy, mask, g, dw);
    bool fresh = false;
    if (T* dx = x.grad_acc(&fresh)) {
      const T* back = detail::packed(t, static_cast<const T*>(flipped(t, w.value(), g)), g.k * g.k * g.o, g.c,
                                     g.c, Index{1});
      const T* dz = with_border(t, dy, g, g.o, mask);
      convolve<T>(dz, back, g, g.o, g.c, nullptr, false, !fresh, dx);
    }
  });
  return out;
}

template Var<float> conv2d(Var<float>, Var<float>, Var<float>, Activation);
template Var<double> conv2d(Var<double>, Var<double>, Var<double>, Activation);

}  // namespace fieldmark
