// The ops that are functions: name(x), name(a, b), with their options.
#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/batched_matmul.h>
#include <fieldmark/engine/ops/cholesky.h>
#include <fieldmark/engine/ops/comparison.h>
#include <fieldmark/engine/ops/conv2d.h>
#include <fieldmark/engine/ops/dense.h>
#include <fieldmark/engine/ops/determinant.h>
#include <fieldmark/engine/ops/eigenvalues.h>
#include <fieldmark/engine/ops/gather.h>
#include <fieldmark/engine/ops/layer_norm.h>
#include <fieldmark/engine/ops/layout.h>
#include <fieldmark/engine/ops/linear_solve.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/math.h>
#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/ops/reduce.h>
#include <fieldmark/engine/ops/reduce_axes.h>
#include <fieldmark/engine/ops/relu_family.h>
#include <fieldmark/engine/ops/resample.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/engine/ops/softmax.h>
#include <pybind11/stl.h>

#include "tape_value.h"

namespace fieldmark::python {
namespace {

using namespace py::literals;

std::vector<int> axes_of(const py::object& axes) {
  if (py::isinstance<py::int_>(axes)) return {axes.cast<int>()};
  return axes.cast<std::vector<int>>();
}

Shape shape_from(const std::vector<Index>& extents) { return Shape(std::span<const Index>(extents)); }

// name(x) for ops of one value without options.
template <class T>
void bind_maps(py::module_& module) {
  using Map = Var<T> (*)(Var<T>);
  const std::pair<const char*, Map> maps[] = {{"relu", relu<T>},
                                              {"sigmoid", sigmoid<T>},
                                              {"tanh", tanh<T>},
                                              {"exp", exp<T>},
                                              {"softplus", softplus<T>},
                                              {"silu", silu<T>},
                                              {"gelu", gelu<T>},
                                              {"negate", negate<T>},
                                              {"reciprocal", reciprocal<T>},
                                              {"abs", abs<T>},
                                              {"square", square<T>},
                                              {"sqrt", sqrt<T>},
                                              {"log", log<T>},
                                              {"log1p", log1p<T>},
                                              {"expm1", expm1<T>},
                                              {"sin", sin<T>},
                                              {"cos", cos<T>},
                                              {"inverse", inverse<T>},
                                              {"cholesky", cholesky<T>},
                                              {"determinant", determinant<T>},
                                              {"log_determinant", log_determinant<T>},
                                              {"symmetric_eigenvalues", symmetric_eigenvalues<T>},
                                              {"global_avg_pool", global_avg_pool<T>},
                                              {"detach", detach<T>}};
  for (const auto& [name, map] : maps)
    module.def(
        name, [map = map](const Value<T>& x) { return x.with(map(x.get())); }, "x"_a);
}

// name(a, b).
template <class T>
void bind_pairs(py::module_& module) {
  using Pair = Var<T> (*)(Var<T>, Var<T>);
  const std::pair<const char*, Pair> pairs[] = {
      {"minimum", minimum<T>}, {"maximum", maximum<T>},       {"greater", greater<T>}, {"less", less<T>},
      {"equal", equal<T>},     {"matmul", batched_matmul<T>}, {"solve", solve<T>}};
  for (const auto& [name, pair] : pairs)
    module.def(
        name, [pair = pair](const Value<T>& a, const Value<T>& b) { return a.with(pair(a.get(), b.get())); },
        "a"_a, "b"_a);
}

// Reductions over all elements, or over some axes.
template <class T>
void bind_reductions(py::module_& module) {
  using Reduce = Var<T> (*)(Var<T>, const Axes&, KeepAxes);
  const std::pair<const char*, Reduce> reductions[] = {{"sum", sum<T>},
                                                       {"mean", mean<T>},
                                                       {"variance", variance<T>},
                                                       {"max", max<T>},
                                                       {"logsumexp", logsumexp<T>}};
  for (const auto& [name, reduce] : reductions)
    module.def(
        name,
        [reduce = reduce](const Value<T>& x, const py::object& axis, bool keepdims) {
          std::vector<int> axes;
          if (axis.is_none())
            for (int k = 0; k < x.get().shape().rank(); ++k) axes.push_back(k);
          else
            axes = axes_of(axis);
          return x.with(
              reduce(x.get(), Axes(std::span<const int>(axes)), keepdims ? KeepAxes::yes : KeepAxes::no));
        },
        "x"_a, "axis"_a = py::none(), "keepdims"_a = false);
  module.def(
      "softmax", [](const Value<T>& x, int axis) { return x.with(softmax(x.get(), axis)); }, "x"_a,
      "axis"_a = -1);
}

template <class T>
void bind_layout(py::module_& module) {
  module.def(
      "reshape",
      [](const Value<T>& x, const std::vector<Index>& shape) {
        return x.with(reshape(x.get(), shape_from(shape)));
      },
      "x"_a, "shape"_a);
  module.def(
      "broadcast_to",
      [](const Value<T>& x, const std::vector<Index>& shape) {
        return x.with(broadcast_to(x.get(), shape_from(shape)));
      },
      "x"_a, "shape"_a);
  module.def(
      "permute",
      [](const Value<T>& x, const std::vector<int>& order) {
        return x.with(permute(x.get(), std::span<const int>(order)));
      },
      "x"_a, "order"_a);
  module.def(
      "transpose", [](const Value<T>& x, int a, int b) { return x.with(transpose(x.get(), a, b)); }, "x"_a,
      "a"_a = -2, "b"_a = -1);
  module.def(
      "pad",
      [](const Value<T>& x, int axis, Index before, Index after, double value) {
        return x.with(pad(x.get(), axis, before, after, value));
      },
      "x"_a, "axis"_a, "before"_a, "after"_a, "value"_a = 0.0);
  module.def(
      "cumsum", [](const Value<T>& x, int axis) { return x.with(cumsum(x.get(), axis)); }, "x"_a,
      "axis"_a = -1);
  module.def(
      "slice",
      [](const Value<T>& x, int axis, Index begin, Index count) {
        return x.with(slice(x.get(), axis, begin, count));
      },
      "x"_a, "axis"_a, "begin"_a, "count"_a);
  module.def(
      "concatenate",
      [](const std::vector<Value<T>>& xs, int axis) {
        if (xs.empty()) throw py::value_error("[concatenate] needs at least one value, got none");
        std::vector<Var<T>> vars;
        for (const auto& x : xs) vars.push_back(x.get());
        return xs.front().with(concatenate(std::span<const Var<T>>(vars), axis));
      },
      "xs"_a, "axis"_a = -1);
}

template <class T>
void bind_indexing(py::module_& module) {
  module.def(
      "gather",
      [](const Value<T>& x, int axis, const py::object& index) {
        const py::array array = borrowed<std::int32_t>("gather: index", index);
        return x.with(gather(x.get(), axis, elements<std::int32_t>(array)));
      },
      "x"_a, "axis"_a, "index"_a);
  module.def(
      "scatter_add",
      [](const Value<T>& x, int axis, const py::object& index, Index extent) {
        const py::array array = borrowed<std::int32_t>("scatter_add: index", index);
        return x.with(scatter_add(x.get(), axis, elements<std::int32_t>(array), extent));
      },
      "x"_a, "axis"_a, "index"_a, "extent"_a);
  module.def(
      "where",
      [](const Value<T>& mask, const Value<T>& a, const Value<T>& b) {
        return a.with(where(mask.get(), a.get(), b.get()));
      },
      "mask"_a, "a"_a, "b"_a);
  module.def(
      "clamp", [](const Value<T>& x, double low, double high) { return x.with(clamp(x.get(), low, high)); },
      "x"_a, "low"_a, "high"_a);
}

template <class T>
void bind_layers(py::module_& module) {
  using V = const Value<T>&;
  module.def(
      "dense",
      [](V x, V w, V b, bool with_relu) {
        return x.with(dense(x.get(), w.get(), b.get(), with_relu ? Activation::relu : Activation::none));
      },
      "x"_a, "w"_a, "b"_a, "relu"_a = false, "x w + b of rows x [n, in], w [in, out], b [out].");
  module.def(
      "conv2d",
      [](V x, V w, V b, Index stride, Index padding, bool with_relu) {
        return x.with(conv2d(x.get(), w.get(), b.get(), ConvWindow{.stride = stride, .padding = padding},
                             with_relu ? Activation::relu : Activation::none));
      },
      "x"_a, "w"_a, "b"_a, "stride"_a = 1, "padding"_a = 0, "relu"_a = false,
      "Convolution of images x [n, h, w, channels], see ops/conv2d.h.");
  module.def(
      "layer_norm",
      [](V x, V gamma, V beta, double eps) {
        return x.with(layer_norm(x.get(), gamma.get(), beta.get(), eps));
      },
      "x"_a, "gamma"_a, "beta"_a, "eps"_a = 1e-5);
  module.def(
      "max_pool",
      [](V x, Index size, Index stride) {
        return x.with(max_pool(x.get(), MaxPool{.size = size, .stride = stride}));
      },
      "x"_a, "size"_a = 2, "stride"_a = 2);
  module.def(
      "upsample_nearest", [](V x, Index factor) { return x.with(upsample_nearest(x.get(), factor)); }, "x"_a,
      "factor"_a);
  module.def(
      "mse_loss", [](V a, V b) { return a.with(mse_loss(a.get(), b.get())); }, "a"_a, "b"_a);
  module.def(
      "l1_loss", [](V a, V b) { return a.with(l1_loss(a.get(), b.get())); }, "a"_a, "b"_a);
  module.def(
      "huber_loss", [](V a, V b, double delta) { return a.with(huber_loss(a.get(), b.get(), delta)); }, "a"_a,
      "b"_a, "delta"_a);
  module.def(
      "softmax_cross_entropy",
      [](V logits, const py::object& labels) {
        const py::array array = borrowed<std::int32_t>("softmax_cross_entropy: labels", labels);
        return logits.with(softmax_cross_entropy(logits.get(), elements<std::int32_t>(array)));
      },
      "logits"_a, "labels"_a);
}

}  // namespace

template <class T>
void bind_ops(py::module_& module) {
  bind_maps<T>(module);
  bind_pairs<T>(module);
  bind_reductions<T>(module);
  bind_layout<T>(module);
  bind_indexing<T>(module);
  bind_layers<T>(module);
}
template void bind_ops<float>(py::module_&);
template void bind_ops<double>(py::module_&);

}  // namespace fieldmark::python
