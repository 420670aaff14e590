// The ops of networks: affine maps, convolutions, norms, pooling, losses.
#include <fieldmark/engine/dual/layout.h>
#include <fieldmark/engine/dual/loss.h>
#include <fieldmark/engine/dual/matrices.h>
#include <fieldmark/engine/dual/norm.h>
#include <fieldmark/engine/dual/reduce.h>
#include <fieldmark/engine/ops/batch_norm.h>
#include <fieldmark/engine/ops/conv2d.h>
#include <fieldmark/engine/ops/conv_transpose2d.h>
#include <fieldmark/engine/ops/dense.h>
#include <fieldmark/engine/ops/feature_distance.h>
#include <fieldmark/engine/ops/group_norm.h>
#include <fieldmark/engine/ops/layer_norm.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/ops/reduce.h>
#include <fieldmark/engine/ops/resample.h>
#include <fieldmark/engine/ops/softmax.h>

#include "number_argument.h"
#include "relu_argument.h"
#include "tape_value.h"

namespace fieldmark::python {
namespace {

using namespace py::literals;

// Beyond these, the engine's extents would leave the integers of 64 bits.
void require_window(const char* op, const ConvWindow& window) {
  require_within(op, "stride", window.stride, 1);
  require_within(op, "padding", window.padding, 0);
  require_within(op, "dilation", window.dilation, 1);
  require_within(op, "groups", window.groups, 1);
}

template <class T>
void bind_products(py::module_& module) {
  using V = const Value<T>&;
  module.def(
      "dense",
      [](V x, V w, V b, Flag relu) {
        return x.with(on([&](auto u, auto v, auto s) { return dense(u, v, s, activation(relu)); }, x, w, b));
      },
      "x"_a, "w"_a, "b"_a, "relu"_a = false, once<T>("x w + b of rows x [N, in], w [in, out], b [out]."));
  module.def(
      "conv2d",
      [](V x, V w, V b, Index stride, Index padding, Flag relu, Index dilation, Index groups) {
        const ConvWindow window{.stride = stride, .padding = padding, .dilation = dilation, .groups = groups};
        require_window("conv2d", window);
        return x.with(
            on([&](auto u, auto v, auto s) { return conv2d(u, v, s, window, activation(relu)); }, x, w, b));
      },
      "x"_a, "w"_a, "b"_a, "stride"_a = 1, "padding"_a = 0, "relu"_a = false, "dilation"_a = 1,
      "groups"_a = 1,
      once<T>("Convolution of images x [N, H, W, C] with w [K, K, C / groups, O] and b [O]; `padding` pixels "
              "of zeros\n"
              "are around the image, elements of a window are `dilation` pixels apart, and each group of "
              "outputs sees\n"
              "one group of channels. ShapeError if they do not fit, ValueError if a number is out of "
              "range."));
  module.def(
      "conv_transpose2d",
      [](V x, V w, V b, Index stride, Index padding) {
        const ConvWindow window{.stride = stride, .padding = padding};
        require_window("conv_transpose2d", window);
        return x.with(conv_transpose2d(x.get("conv_transpose2d"), w.get("conv_transpose2d"),
                                       b.get("conv_transpose2d"), window));
      },
      "x"_a, "w"_a, "b"_a, "stride"_a = 1, "padding"_a = 0,
      once<T>(
          "Transposed convolution of images x [N, H, W, C] with w [K, K, O, C] and b [O], the gradient of "
          "conv2d() in\n"
          "its input plus a bias: y[n, i s + u - p, j s + v - p, o] += sum_c x[n, i, j, c] w[u, v, o, "
          "c], from\n"
          "y = b, of shape [N, (H - 1) s + K - 2 p, (W - 1) s + K - 2 p, O], s = stride, p = padding. "
          "ShapeError if\n"
          "they do not fit, ValueError if a number is out of range."));
}

template <class T>
void bind_norms(py::module_& module) {
  using V = const Value<T>&;
  module.def(
      "layer_norm",
      [](V x, V gamma, V beta, Number eps) {
        return x.with(on([&](auto v, auto g, auto b) { return layer_norm(v, g, b, eps); }, x, gamma, beta));
      },
      "x"_a, "gamma"_a, "beta"_a, "eps"_a = 1e-5,
      once<T>("gamma (x - mean) / sqrt(var + eps) + beta with the statistics of each row of the last axis."));
  module.def(
      "group_norm",
      [](V x, V gamma, V beta, Index groups, Number eps, Flag relu) {
        const GroupNormOptions options{.groups = groups, .eps = eps, .relu = relu};
        return x.with(
            on([&](auto v, auto g, auto b) { return group_norm(v, g, b, options); }, x, gamma, beta));
      },
      "x"_a, "gamma"_a, "beta"_a, "groups"_a = 8, "eps"_a = 1e-5, "relu"_a = false,
      once<T>("gamma (x - mean) / sqrt(var + eps) + beta of images [N, H, W, C], with the statistics of each "
              "image's\n"
              "groups of neighbouring channels."));
  module.def(
      "batch_norm",
      [](V x, V gamma, V beta, Number eps, Flag relu, BatchStatistics* statistics) {
        const BatchNormOptions options{.eps = eps, .relu = relu};
        return x.with(on([&](auto v, auto g, auto b) { return batch_norm(v, g, b, options, statistics); }, x,
                         gamma, beta));
      },
      "x"_a, "gamma"_a, "beta"_a, "eps"_a = 1e-5, "relu"_a = false, "statistics"_a = nullptr,
      once<T>("gamma (x - mean) / sqrt(var + eps) + beta of images [N, H, W, C], with the statistics of the "
              "batch,\n"
              "which go to `statistics` too."));
  module.def(
      "batch_norm_fixed",
      [](V x, V gamma, V beta, const py::object& mean, const py::object& variance, Number eps, Flag relu) {
        const py::array m = borrowed<T>("batch_norm_fixed: mean", mean),
                        v = borrowed<T>("batch_norm_fixed: variance", variance);
        const BatchNormOptions options{.eps = eps, .relu = relu};
        return x.with(
            on([&](auto y, auto g,
                   auto b) { return batch_norm_fixed(y, g, b, elements<T>(m), elements<T>(v), options); },
               x, gamma, beta));
      },
      "x"_a, "gamma"_a, "beta"_a, "mean"_a, "variance"_a, "eps"_a = 1e-5, "relu"_a = false,
      once<T>("gamma (x - mean) / sqrt(variance + eps) + beta of images [N, H, W, C], with given statistics "
              "[C],\n"
              "arrays that are copied. ValueError unless eps is above 0 and each variance at least 0."));
}

Interpolation interpolation_of(const std::string& name) {
  if (name == "bilinear") return Interpolation::bilinear;
  if (name == "nearest") return Interpolation::nearest;
  throw ValueError("[upsample_to] mode must be bilinear or nearest, got '" + name + "'");
}

template <class T>
void bind_resampling(py::module_& module) {
  using V = const Value<T>&;
  module.def(
      "max_pool",
      [](V x, Index size, Index stride, Flag ceil_mode) {
        require_within("max_pool", "size", size, 1);
        require_within("max_pool", "stride", stride, 1);
        return x.with(
            max_pool(x.get("max_pool"), MaxPool{.size = size, .stride = stride, .ceil_mode = ceil_mode}));
      },
      "x"_a, "size"_a = 2, "stride"_a = 2, "ceil_mode"_a = false,
      once<T>("The largest of each channel over windows of images [N, H, W, C]; ceil_mode keeps windows that "
              "cross\n"
              "the lower or right edge."));
  module.def(
      "avg_pool",
      [](V x, Index size) {
        require_within("avg_pool", "size", size, 1);
        return x.with(on([&](auto v) { return avg_pool(v, size); }, x));
      },
      "x"_a, "size"_a,
      once<T>("The mean over windows of size x size pixels: [N, H, W, C] to [N, H / size, W / size, C]."));
  module.def(
      "upsample_nearest",
      [](V x, Index factor) {
        require_within("upsample_nearest", "factor", factor, 1);
        return x.with(on([&](auto v) { return upsample_nearest(v, factor); }, x));
      },
      "x"_a, "factor"_a, once<T>("Repeats every pixel of images [N, H, W, C] factor x factor times."));
  module.def(
      "upsample_to",
      [](V x, Index height, Index width, const std::string& mode) {
        require_within("upsample_to", "height", height, 0);
        require_within("upsample_to", "width", width, 0);
        const Interpolation by = interpolation_of(mode);
        return x.with(on([&](auto v) { return upsample_to(v, height, width, by); }, x));
      },
      "x"_a, "height"_a, "width"_a, "mode"_a = "bilinear",
      once<T>(
          "Resamples images [N, H, W, C] to [N, height, width, C], bilinear or nearest, with half-pixel "
          "centres as\n"
          "PyTorch's align_corners=False: pixel i is at (i + 1/2) H / height - 1/2. It does not filter, so "
          "average\n"
          "before you shrink."));
}

// Returns an array of the given shape, which backward reads.
template <class U, class T>
Reading<U> matching(const char* where, const Value<T>& x, const Shape& shape, const py::object& given) {
  const py::array array = x.tape->template reads<U>(where, given);
  if (shape_of(array) != shape)
    throw ShapeError("[" + std::string(where) + "] must have shape " + shape.str() + ", got " +
                     shape_of(array).str());
  return {array, elements<U>(array)};
}

// The weights of a mean; None: all 1.
template <class T>
Reading<T> weights_of(const char* where, const Value<T>& x, const Shape& shape, const py::object& given) {
  if (given.is_none()) return {};
  return matching<T>(where, x, shape, given);
}

Shape rows_of(const Shape& logits) {
  std::vector<Index> rows;
  for (int k = 0; k + 1 < logits.rank(); ++k) rows.push_back(logits[k]);
  return Shape(std::span<const Index>(rows));
}

template <class T>
void bind_losses(py::module_& module) {
  using V = const Value<T>&;
  using Object = const py::object&;
  module.def(
      "mse_loss",
      [](V a, V b, Object weights) {
        const auto w = weights_of("mse_loss: weights", a, a.primal().shape(), weights);
        return a.with(on([&](auto u, auto v) { return mse_loss(u, v, w.elements); }, a, b), w);
      },
      "a"_a, "b"_a, "weights"_a = py::none(),
      once<T>(
          "The mean of (a - b)^2; `weights`, an array >= 0 of the shape of a, makes it sum w d^2 / sum w."));
  module.def(
      "l1_loss",
      [](V a, V b, Object weights) {
        const auto w = weights_of("l1_loss: weights", a, a.primal().shape(), weights);
        return a.with(on([&](auto u, auto v) { return l1_loss(u, v, w.elements); }, a, b), w);
      },
      "a"_a, "b"_a, "weights"_a = py::none(),
      once<T>(
          "The mean of |a - b|; `weights`, an array >= 0 of the shape of a, makes it sum w |d| / sum w."));
  module.def(
      "huber_loss",
      [](V a, V b, Number delta, Object weights) {
        const auto w = weights_of("huber_loss: weights", a, a.primal().shape(), weights);
        return a.with(on([&](auto u, auto v) { return huber_loss(u, v, delta, w.elements); }, a, b), w);
      },
      "a"_a, "b"_a, "delta"_a, "weights"_a = py::none(),
      once<T>(
          "The mean of d^2 / 2 where |d| = |a - b| <= delta, else of delta (|d| - delta / 2); delta > 0;\n"
          "`weights`, an array >= 0 of the shape of a, makes it a weighted mean."));
  module.def(
      "bce_with_logits",
      [](V logits, Object targets, Object weights) {
        const Shape shape = logits.primal().shape();
        const auto t = matching<T>("bce_with_logits: targets", logits, shape, targets);
        const auto w = weights_of("bce_with_logits: weights", logits, shape, weights);
        return logits.with(on([&](auto v) { return bce_with_logits(v, t.elements, w.elements); }, logits), t,
                           w);
      },
      "logits"_a, "targets"_a, "weights"_a = py::none(),
      once<T>(
          "The mean cross-entropy of logits against targets, an array in [0, 1]; `weights`, an array >= 0 of "
          "the\nshape of logits, makes it a weighted mean."));
  module.def(
      "softmax_cross_entropy",
      [](V logits, Object labels, Object weights) {
        const Shape rows = rows_of(logits.primal().shape());
        const auto l = matching<std::int32_t>("softmax_cross_entropy: labels", logits, rows, labels);
        const auto w = weights_of("softmax_cross_entropy: weights", logits, rows, weights);
        return logits.with(
            on([&](auto v) { return softmax_cross_entropy(v, l.elements, w.elements); }, logits), l, w);
      },
      "logits"_a, "labels"_a, "weights"_a = py::none(),
      once<T>(
          "The mean cross-entropy of logits [.., C] against labels [..] of int32 in [-1, C), -1: ignored;\n"
          "weights [..] >= 0."));
}

template <class T>
void bind_weighted_means(py::module_& module) {
  using V = const Value<T>&;
  using Object = const py::object&;
  module.def(
      "weighted_mean",
      [](V x, Object weights) {
        const auto w = matching<T>("weighted_mean: weights", x, x.primal().shape(), weights);
        return x.with(on([&](auto v) { return weighted_mean(v, w.elements); }, x), w);
      },
      "x"_a, "weights"_a,
      once<T>(
          "sum w x / sum w of all elements, w an array >= 0 of the shape of x. ValueError if all are 0."));
  module.def(
      "feature_distance",
      [](V a, V b, Object weights) {
        const Shape shape = a.primal().shape();
        const Shape channels = shape.rank() == 0 ? shape : Shape{shape[-1]};
        const auto w = matching<T>("feature_distance: weights", a, channels, weights);
        return a.with(on([&](auto u, auto v) { return feature_distance(u, v, w.elements); }, a, b), w);
      },
      "a"_a, "b"_a, "weights"_a,
      once<T>("The distance [N] of LPIPS: features [N, H, W, C] scaled to length 1 at each pixel, squared "
              "differences\n"
              "weighted by channel [C], averaged over pixels."));
}

}  // namespace

template <class T>
void bind_network_ops(py::module_& module) {
  bind_products<T>(module);
  bind_norms<T>(module);
  bind_resampling<T>(module);
  bind_losses<T>(module);
  bind_weighted_means<T>(module);
}
template void bind_network_ops<float>(py::module_&);
template void bind_network_ops<double>(py::module_&);

}  // namespace fieldmark::python
