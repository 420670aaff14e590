#include <fieldmark/engine/ops/conv_transpose2d.h>
#include <fieldmark/engine/shape_checks.h>

#include "ops/chunks.h"
#include "ops/conv2d_parts.h"
#include "ops/window_checks.h"

namespace fieldmark {
namespace {

// The convolution from the result to x, whose transpose this op is.
detail::ConvGeometry transposed_geometry(const Shape& x, const Shape& w, const Shape& b,
                                         const ConvWindow& window) {
  const char* op = "conv_transpose2d";
  check_rank(op, "x", x, 4, "[N, H, W, C]");
  check_rank(op, "w", w, 4, "[K, K, O, C]");
  check_rank(op, "b", b, 1, "[O]");
  check_extent(op, "w", w, 1, w[0], "a square window");
  check_extent(op, "w", w, 3, x[3], "the channels of x", x);
  check_extent(op, "b", b, 0, w[2], "the outputs of w", w);
  detail::check_step(op, "stride", window.stride, 1);
  detail::check_step(op, "padding", window.padding, 0);
  if (window.dilation != 1 || window.groups != 1)
    throw ValueError("[conv_transpose2d] dilation and groups must be 1, got dilation " +
                     std::to_string(window.dilation) + " and groups " + std::to_string(window.groups));
  if (x[1] < 1 || x[2] < 1)
    throw ShapeError("[conv_transpose2d] x must have at least one pixel, got shape " + x.str());
  Index height = 0, width = 0;  // of the result with its border
  const auto bordered = [&](Index n, Index* extent) {
    return !__builtin_mul_overflow(n - 1, window.stride, extent) &&
           !__builtin_add_overflow(*extent, w[0], extent);
  };
  if (!bordered(x[1], &height) || !bordered(x[2], &width) ||
      !detail::is_countable({x[0], height, width, w[2]}))
    throw ValueError(
        "[conv_transpose2d] stride must leave fewer than 2^60 elements of the result with its border, got " +
        std::to_string(window.stride) + " for shape " + x.str());
  const Index border = 2 * window.padding;
  if (std::min(height, width) - border < 1)
    throw ShapeError("[conv_transpose2d] x: a padding of " + std::to_string(window.padding) +
                     " leaves no pixel of the result, got shape " + x.str());
  return {x[0], height - border, width - border, w[2], w[3], w[0], window.stride, window.padding};
}

// y = b at every pixel.
template <class T>
void fill_with_bias(const T* b, Index pixels, Index channels, T* y) {
  parallel_for(pixels, detail::row_grain(channels), [=](Index begin, Index end) {
    for (Index p = begin; p < end; ++p) std::copy_n(b, channels, y + p * channels);
  });
}

}  // namespace

template <class T>
Var<T> conv_transpose2d(Var<T> x, Var<T> w, Var<T> b, ConvWindow window) {
  const detail::ConvGeometry g = transposed_geometry(x.shape(), w.shape(), b.shape(), window);
  const Index pixels = g.n * g.h * g.w;
  Tape<T>& tape = x.tape();
  T* y = nullptr;
  const Var<T> out = tape.output({g.n, g.h, g.w, g.c}, &y, {x, w, b});
  fill_with_bias(b.value(), pixels, g.c, y);
  detail::direct_input_gradient(tape, g, w.value(), x.value(), static_cast<const T*>(nullptr), true, y);

  // y is linear in x and in w: with C the convolution, <dy, y> = <C(dy, w), x>. So dx = C(dy, w), dw is the
  // weight gradient of C at dy for the cotangent x, and db sums dy over the pixels.
  tape.on_backward(out, [=](const T* dy) {
    Tape<T>& t = x.tape();
    const T* none = nullptr;
    if (T* db = b.grad_acc()) detail::bias_gradient(t, dy, none, pixels, g.c, db);
    const T* bordered = detail::with_border(t, g, dy, none);
    if (T* dw = w.grad_acc()) detail::direct_weight_gradient(t, g, bordered, x.value(), none, dw);
    bool fresh = false;
    if (T* dx = x.grad_acc(&fresh))
      detail::direct_products(t, g, bordered,
                              detail::Convolution<T>{.w = w.value(), .accumulate = !fresh, .y = dx});
  });
  return out;
}

template Var<float> conv_transpose2d(Var<float>, Var<float>, Var<float>, ConvWindow);
template Var<double> conv_transpose2d(Var<double>, Var<double>, Var<double>, ConvWindow);

}  // namespace fieldmark
