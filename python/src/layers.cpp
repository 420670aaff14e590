// Layers, which register their parameters by name and read them in each pass.
#include <fieldmark/engine/nn/batch_norm.h>
#include <fieldmark/engine/nn/conv2d.h>
#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/engine/nn/embedding.h>
#include <fieldmark/engine/nn/group_norm.h>
#include <fieldmark/engine/nn/layer_norm.h>
#include <pybind11/stl.h>

#include <optional>

#include "number_argument.h"
#include "relu_argument.h"
#include "tape_value.h"

namespace fieldmark::python {
namespace {

using namespace py::literals;

template <class T>
using StorePtr = std::shared_ptr<StoreHandle<T>>;

// A layer and its parameter store.
template <class T, class L>
struct LayerHandle {
  std::string kind;  // for error messages
  StorePtr<T> store;
  L layer;

  template <class... A>
  static LayerHandle* make(const char* kind, const StorePtr<T>& s, const std::string& name, A&&... options) {
    return new LayerHandle{kind, s, L(s->open(kind), name, std::forward<A>(options)...)};
  }
  // f(layer, parameters of this pass, x)
  template <class F>
  Value<T> apply(const py::object& given, F f) const {
    const Value<T>& x = value_of<T>(kind + ": x", given);
    const Var<T> var = x.get(kind.c_str());
    return x.tape->reading(store, [&] { return x.with(f(layer, x.tape->params(*store), var)); });
  }
  Value<T> operator()(const py::object& x) const {
    return apply(x, [](const L& l, const Params<T>& p, Var<T> v) { return l(p, v); });
  }
};

void require_window(Index kernel, Index stride, const std::optional<Index>& padding) {
  require_within("Conv2d", "kernel", kernel, 1);
  if (kernel % 2 == 0 && !padding)
    throw ValueError("[Conv2d] kernel must be odd unless padding is given, got " + std::to_string(kernel));
  require_within("Conv2d", "stride", stride, 1);
  if (padding) require_within("Conv2d", "padding", *padding, 0);
}

template <class T>
void bind_products(py::module_& module, const std::string& suffix) {
  using DenseHandle = LayerHandle<T, Dense<T>>;
  using Conv2dHandle = LayerHandle<T, Conv2d<T>>;
  py::class_<DenseHandle>(module, ("Dense_" + suffix).c_str(), "An affine layer.")
      .def(py::init([](const StorePtr<T>& s, const std::string& name, Index inputs, Index outputs, Flag relu,
                       std::uint64_t seed, Flag bias) {
             require_within("Dense", "inputs", inputs, 1);
             require_within("Dense", "outputs", outputs, 1);
             return DenseHandle::make(
                 "Dense", s, name,
                 DenseOptions{.in = inputs, .out = outputs, .activation = activation(relu), .bias = bias},
                 seed);
           }),
           py::arg("parameters").none(false), "name"_a, "inputs"_a, "outputs"_a, "relu"_a, "seed"_a,
           "bias"_a = true)
      .def("__call__", &DenseHandle::operator(), "x"_a, "x [N, inputs] to [N, outputs].");
  py::class_<Conv2dHandle>(module, ("Conv2d_" + suffix).c_str(), "A convolution of images.")
      .def(py::init([](const StorePtr<T>& s, const std::string& name, Index inputs, Index outputs,
                       Index kernel, Flag relu, std::uint64_t seed, Index stride,
                       std::optional<Index> padding, Flag bias) {
             require_within("Conv2d", "inputs", inputs, 1);
             require_within("Conv2d", "outputs", outputs, 1);
             require_window(kernel, stride, padding);
             return Conv2dHandle::make("Conv2d", s, name,
                                       Conv2dOptions{.in = inputs,
                                                     .out = outputs,
                                                     .kernel = kernel,
                                                     .activation = activation(relu),
                                                     .stride = stride,
                                                     .padding = padding,
                                                     .bias = bias},
                                       seed);
           }),
           py::arg("parameters").none(false), "name"_a, "inputs"_a, "outputs"_a, "kernel"_a, "relu"_a,
           "seed"_a, "stride"_a = 1, "padding"_a = py::none(), "bias"_a = true)
      .def("__call__", &Conv2dHandle::operator(), "x"_a,
           "x [N, H, W, inputs] to [N, H', W', outputs], as large as x by default.");
}

template <class T>
void bind_norms(py::module_& module, const std::string& suffix) {
  using BatchHandle = LayerHandle<T, BatchNorm<T>>;
  using GroupHandle = LayerHandle<T, GroupNorm<T>>;
  py::class_<BatchHandle>(module, ("BatchNorm_" + suffix).c_str(), "Batch normalisation of images.")
      .def(py::init([](const StorePtr<T>& s, const std::string& name, Index channels, double eps, Flag relu) {
             require_within("BatchNorm", "channels", channels, 1);
             return BatchHandle::make("BatchNorm", s, name, channels,
                                      BatchNormOptions{.eps = eps, .relu = relu});
           }),
           py::arg("parameters").none(false), "name"_a, "channels"_a, "eps"_a, "relu"_a)
      .def(
          "__call__",
          [](const BatchHandle& b, const py::object& x, BatchStatistics* statistics) {
            return b.apply(x,
                           [&](const auto& l, const Params<T>& p, Var<T> v) { return l(p, v, statistics); });
          },
          "x"_a, "statistics"_a = nullptr,
          "Normalises x [N, H, W, C] with the statistics of the batch, which go to `statistics` too.")
      .def(
          "evaluate",
          [](const BatchHandle& b, const py::object& x) {
            return b.apply(x, [](const auto& l, const Params<T>& p, Var<T> v) { return l.evaluate(p, v); });
          },
          "x"_a, "Normalises with the running statistics.")
      .def(
          "update",
          [](const BatchHandle& b, const BatchStatistics& statistics, double momentum) {
            b.layer.update(b.store->store, statistics, momentum);
          },
          "statistics"_a, "momentum"_a = 0.1, "running = (1 - momentum) running + momentum batch.");
  py::class_<GroupHandle>(module, ("GroupNorm_" + suffix).c_str(), "Group normalisation of images.")
      .def(py::init([](const StorePtr<T>& s, const std::string& name, Index channels, Index groups,
                       double eps, Flag relu) {
             require_within("GroupNorm", "channels", channels, 1);
             require_within("GroupNorm", "groups", groups, 1);
             return GroupHandle::make("GroupNorm", s, name, channels,
                                      GroupNormOptions{.groups = groups, .eps = eps, .relu = relu});
           }),
           py::arg("parameters").none(false), "name"_a, "channels"_a, "groups"_a, "eps"_a, "relu"_a)
      .def("__call__", &GroupHandle::operator(), "x"_a, "x [N, H, W, C] to the same shape.");
}

template <class T>
void bind_layer_norm(py::module_& module, const std::string& suffix) {
  using Handle = LayerHandle<T, LayerNorm<T>>;
  py::class_<Handle>(module, ("LayerNorm_" + suffix).c_str(), "Layer normalisation of rows.")
      .def(py::init([](const StorePtr<T>& s, const std::string& name, Index channels, double eps) {
             require_within("LayerNorm", "channels", channels, 1);
             return Handle::make("LayerNorm", s, name, channels, eps);
           }),
           py::arg("parameters").none(false), "name"_a, "channels"_a, "eps"_a)
      .def("__call__", &Handle::operator(), "x"_a, "x [.., C] to the same shape.");
}

template <class T>
void bind_embedding(py::module_& module, const std::string& suffix) {
  using Handle = LayerHandle<T, Embedding<T>>;
  py::class_<Handle>(module, ("Embedding_" + suffix).c_str(), "A learnt vector for each of some items.")
      .def(py::init([](const StorePtr<T>& s, const std::string& name, Index count, Index width,
                       std::uint64_t seed) {
             require_within("Embedding", "count", count, 1);
             require_within("Embedding", "width", width, 1);
             return Handle::make("Embedding", s, name, EmbeddingOptions{.count = count, .width = width},
                                 seed);
           }),
           py::arg("parameters").none(false), "name"_a, "count"_a, "width"_a, "seed"_a)
      .def(
          "__call__",
          [](const Handle& e, const py::object& given, const py::object& index) {
            const auto tape = tape_of<T>("Embedding", given);
            const auto read = tape->template reads<std::int32_t>("Embedding: index", index);
            if (read.ndim() != 1)
              throw ShapeError("[Embedding: index] must have one axis, got shape " + shape_of(read).str());
            return tape->reading(e.store, [&] {
              const Var<T> rows = e.layer(tape->tape(), tape->params(*e.store), elements<std::int32_t>(read));
              tape->keep(read);
              return Value<T>(tape, rows);
            });
          },
          "tape"_a, "index"_a, "Rows [N, width] by an index [N] of int32 in [0, count), repeats allowed.");
}

}  // namespace

template <class T>
void bind_layers(py::module_& module, const std::string& suffix) {
  bind_products<T>(module, suffix);
  bind_norms<T>(module, suffix);
  bind_layer_norm<T>(module, suffix);
  bind_embedding<T>(module, suffix);
}
template void bind_layers<float>(py::module_&, const std::string&);
template void bind_layers<double>(py::module_&, const std::string&);

}  // namespace fieldmark::python
