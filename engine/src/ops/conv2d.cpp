#include <fieldmark/engine/ops/conv2d.h>
#include <fieldmark/engine/ops/gather.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/engine/shape_checks.h>

#include <memory>

#include "ops/chunks.h"
#include "ops/conv2d_parts.h"
#include "ops/window_checks.h"

namespace fieldmark {
namespace {

using detail::ConvGeometry;

// w'[u, v, o, c] = w[K - 1 - u, K - 1 - v, c, o]: the weights of the convolution that takes dY to dX.
template <class T>
const T* flipped(Tape<T>& tape, const T* w, const ConvGeometry& g) {
  const Index taps = g.k * g.k;
  T* out = tape.scratch(taps * g.c * g.o);
  parallel_for(taps, 1, [=](Index t, Index) {
    for (Index o = 0; o < g.o; ++o)
      for (Index c = 0; c < g.c; ++c) out[((taps - 1 - t) * g.o + o) * g.c + c] = w[(t * g.c + c) * g.o + o];
  });
  return out;
}

ConvGeometry geometry(const Shape& x, const Shape& w, const Shape& b, Index stride = 1, Index padding = 0) {
  check_rank("conv2d", "x", x, 4, "[N, H, W, C]");
  check_rank("conv2d", "w", w, 4, "[K, K, C, O]");
  check_rank("conv2d", "b", b, 1, "[O]");
  check_extent("conv2d", "w", w, 1, w[0], "a square window");
  check_extent("conv2d", "w", w, 2, x[3], "the channels of x", x);
  check_extent("conv2d", "b", b, 0, w[3], "the outputs of w", w);
  return {x[0], x[1], x[2], x[3], w[3], w[0], stride, padding};
}

// Dilates w [K, K, C, O]: its elements are d pixels apart, with zeros between them.
template <class T>
Var<T> dilated(Var<T> w, Index d) {
  const Index k = w.shape()[0];
  const std::span place(w.tape().template scratch<std::int32_t>(k), at(k));
  for (Index u = 0; u < k; ++u) place[at(u)] = static_cast<std::int32_t>(u * d);
  for (const int axis : {0, 1}) w = scatter_add(w, axis, place, (k - 1) * d + 1);
  return w;
}

void check_window(const ConvWindow& window, const Shape& x, const Shape& w) {
  detail::check_step("conv2d", "stride", window.stride, 1);
  detail::check_step("conv2d", "padding", window.padding, 0);
  detail::check_step("conv2d", "dilation", window.dilation, 1);
  detail::check_step("conv2d", "groups", window.groups, 1);
  check_rank("conv2d", "x", x, 4, "[N, H, W, C]");
  check_rank("conv2d", "w", w, 4, "[K, K, C / groups, O]");
  if (x[3] % window.groups != 0 || w[3] % window.groups != 0)
    throw ValueError("[conv2d] groups must divide the channels of x and of w, got " +
                     std::to_string(window.groups) + " for shapes " + x.str() + " and " + w.str());
  if (w[0] > 1 && window.dilation > 1 && window.dilation > (detail::kLargestStep - 1) / (w[0] - 1))
    throw ValueError("[conv2d] dilation must keep the window within " + std::to_string(detail::kLargestStep) +
                     " pixels, got " + std::to_string(window.dilation) + " for w of shape " + w.str());
  const Index border = 2 * window.padding;
  Index height = 0, width = 0;
  if (__builtin_add_overflow(x[1], border, &height) || __builtin_add_overflow(x[2], border, &width) ||
      !detail::is_countable({x[0], height, width, x[3]}))
    throw ValueError("[conv2d] padding must leave fewer than 2^60 elements of x with its border, got " +
                     std::to_string(window.padding) + " for shape " + x.str());
}

void check_outputs(const ConvGeometry& g, const Shape& x, Index padding) {
  if (!detail::is_countable({g.n, g.out_h(), g.out_w(), g.o}))
    throw ValueError("[conv2d] padding must leave fewer than 2^60 outputs, got " + std::to_string(padding) +
                     " for shape " + x.str() + " and " + std::to_string(g.o) + " output channels");
}

enum class Way { direct, few, winograd };

template <class T>
Way way_of(const ConvGeometry& g, ConvMethod method) {
  if (method == ConvMethod::fastest && detail::winograd_pays(g)) return Way::winograd;
  return detail::few_outputs_pay<T>(g) ? Way::few : Way::direct;
}

// Returns what direct_convolve() does; null for the other ways.
template <class T>
const T* convolve_by(Way way, Tape<T>& tape, const ConvGeometry& g, const detail::Convolution<T>& c) {
  if (way == Way::direct) return detail::direct_convolve(tape, g, c);
  if (way == Way::few)
    detail::few_convolve(tape, g, c);
  else
    detail::winograd_convolve(tape, g, c);
  return nullptr;
}

template <class T>
Var<T> convolve(Var<T> x, Var<T> w, Var<T> b, const ConvGeometry& g, Activation activation,
                ConvMethod method) {
  const bool relu = activation == Activation::relu;
  Tape<T>& tape = x.tape();
  T* y = nullptr;
  const Var<T> out = tape.output({g.n, g.out_h(), g.out_w(), g.o}, &y, {x, w, b});
  const Way way = way_of<T>(g, method);
  const T* bordered =
      convolve_by(way, tape, g, {.x = x.value(), .w = w.value(), .bias = b.value(), .relu = relu, .y = y});

  // dZ = dY through the ReLU; db sums it, dW correlates it with x, dX convolves it with the flipped weights;
  // with a stride or without "same" padding, dX scatters it instead.
  tape.on_backward(out, [=](const T* dy) {
    Tape<T>& t = x.tape();
    const T* mask = relu ? y : nullptr;
    if (T* db = b.grad_acc()) detail::bias_gradient(t, dy, mask, g.pixels(), g.o, db);
    if (T* dw = w.grad_acc()) {
      if (way == Way::winograd)
        detail::winograd_weight_gradient(t, g, x.value(), dy, mask, dw);
      else if (way == Way::few)
        detail::few_weight_gradient(t, g, x.value(), dy, mask, dw);
      else
        detail::direct_weight_gradient(t, g, bordered, dy, mask, dw);
    }
    bool fresh = false;
    if (T* dx = x.grad_acc(&fresh)) {
      if (!g.same()) {
        detail::direct_input_gradient(t, g, w.value(), dy, mask, !fresh, dx);
        return;
      }
      const ConvGeometry back = g.transposed();
      convolve_by(way_of<T>(back, method), t, back,
                  {.x = dy, .mask = mask, .w = flipped(t, w.value(), g), .accumulate = !fresh, .y = dx});
    }
  });
  return out;
}

}  // namespace

template <class T>
Var<T> conv2d(Var<T> x, Var<T> w, Var<T> b, Activation activation, ConvMethod method) {
  ConvGeometry g = geometry(x.shape(), w.shape(), b.shape());
  if (g.k % 2 == 0)
    throw ShapeError("[conv2d] w: axis 0 must be odd (a centred window), got shape " + w.shape().str());
  g.padding = g.k / 2;
  return convolve(x, w, b, g, activation, method);
}

template <class T>
Var<T> conv2d(Var<T> x, Var<T> w, Var<T> b, ConvWindow window, Activation activation) {
  check_window(window, x.shape(), w.shape());
  if (const Index groups = window.groups; groups > 1) {
    window.groups = 1;
    const auto group = [=](Var<T> v, Index k) {
      const Index each = v.shape()[-1] / groups;
      return slice(v, k * each, each);
    };
    if (const Index each = x.shape()[3] / groups; w.shape()[2] != each)  // the text allocates
      check_extent("conv2d", "w", w.shape(), 2, each, "channels of x a group, of " + x.shape().str());
    check_rank("conv2d", "b", b.shape(), 1, "[O]");
    check_extent("conv2d", "b", b.shape(), 0, w.shape()[3], "the outputs of w", w.shape());
    auto* parts = x.tape().template scratch<Var<T>>(groups);
    for (Index k = 0; k < groups; ++k)
      std::construct_at(parts + k, conv2d(group(x, k), group(w, k), group(b, k), window, activation));
    return concatenate(std::span<const Var<T>>(parts, at(groups)));
  }
  ConvGeometry g = geometry(x.shape(), w.shape(), b.shape(), window.stride, window.padding);
  g.k = (g.k - 1) * window.dilation + 1;
  if (std::min(g.h, g.w) + 2 * g.padding < g.k)
    throw ShapeError("[conv2d] x: height and width must be at least " + std::to_string(g.k - 2 * g.padding) +
                     " (the window's " + std::to_string(g.k) + " less two borders of " +
                     std::to_string(g.padding) + "), got shape " + x.shape().str());
  check_outputs(g, x.shape(), window.padding);
  if (window.dilation > 1) w = dilated(w, window.dilation);
  return convolve(x, w, b, g, activation, ConvMethod::fastest);
}

template Var<float> conv2d(Var<float>, Var<float>, Var<float>, Activation, ConvMethod);
template Var<double> conv2d(Var<double>, Var<double>, Var<double>, Activation, ConvMethod);
template Var<float> conv2d(Var<float>, Var<float>, Var<float>, ConvWindow, Activation);
template Var<double> conv2d(Var<double>, Var<double>, Var<double>, ConvWindow, Activation);

}  // namespace fieldmark
