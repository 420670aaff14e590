// Layers, which register their parameters by name and read them in each pass.
#include <fieldmark/engine/nn/batch_norm.h>
#include <fieldmark/engine/nn/conv2d.h>
#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/engine/nn/group_norm.h>
#include <pybind11/stl.h>

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
    const Var<T> var = x.get();
    return x.tape->reading(store, [&] { return x.with(f(layer, Params<T>(store->store), var)); });
  }
  Value<T> operator()(const py::object& x) const {
    return apply(x, [](const L& l, const Params<T>& p, Var<T> v) { return l(p, v); });
  }
};

void require_positive(const char* kind, const char* argument, Index given) {
  if (given < 1)
    throw ValueError("[" + std::string(kind) + "] " + argument + " must be at least 1, got " +
                     std::to_string(given));
}

template <class T>
void bind_products(py::module_& module, const std::string& suffix) {
  using DenseHandle = LayerHandle<T, Dense<T>>;
  using Conv2dHandle = LayerHandle<T, Conv2d<T>>;
  py::class_<DenseHandle>(module, ("Dense_" + suffix).c_str(), "An affine layer.")
      .def(py::init([](const StorePtr<T>& s, const std::string& name, Index inputs, Index outputs, Flag relu,
                       std::uint64_t seed) {
             require_positive("Dense", "inputs", inputs);
             require_positive("Dense", "outputs", outputs);
             return DenseHandle::make(
                 "Dense", s, name, DenseOptions{.in = inputs, .out = outputs, .activation = activation(relu)},
                 seed);
           }),
           py::arg("parameters").none(false), "name"_a, "inputs"_a, "outputs"_a, "relu"_a, "seed"_a)
      .def("__call__", &DenseHandle::operator(), "x"_a, "x [N, inputs] to [N, outputs].");
  py::class_<Conv2dHandle>(module, ("Conv2d_" + suffix).c_str(),
                           "A convolution that keeps the size of images.")
      .def(
          py::init([](const StorePtr<T>& s, const std::string& name, Index inputs, Index outputs,
                      Index kernel, Flag relu, std::uint64_t seed) {
            require_positive("Conv2d", "inputs", inputs);
            require_positive("Conv2d", "outputs", outputs);
            if (kernel < 1 || kernel % 2 == 0)
              throw ValueError("[Conv2d] kernel must be odd and at least 1, got " + std::to_string(kernel));
            return Conv2dHandle::make(
                "Conv2d", s, name,
                Conv2dOptions{.in = inputs, .out = outputs, .kernel = kernel, .activation = activation(relu)},
                seed);
          }),
          py::arg("parameters").none(false), "name"_a, "inputs"_a, "outputs"_a, "kernel"_a, "relu"_a,
          "seed"_a)
      .def("__call__", &Conv2dHandle::operator(), "x"_a, "x [N, H, W, inputs] to [N, H, W, outputs].");
}

template <class T>
void bind_norms(py::module_& module, const std::string& suffix) {
  using BatchHandle = LayerHandle<T, BatchNorm<T>>;
  using GroupHandle = LayerHandle<T, GroupNorm<T>>;
  py::class_<BatchHandle>(module, ("BatchNorm_" + suffix).c_str(), "Batch normalisation of images.")
      .def(py::init([](const StorePtr<T>& s, const std::string& name, Index channels, double eps, Flag relu) {
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
             return GroupHandle::make("GroupNorm", s, name, channels,
                                      GroupNormOptions{.groups = groups, .eps = eps, .relu = relu});
           }),
           py::arg("parameters").none(false), "name"_a, "channels"_a, "groups"_a, "eps"_a, "relu"_a)
      .def("__call__", &GroupHandle::operator(), "x"_a, "x [N, H, W, C] to the same shape.");
}

}  // namespace

template <class T>
void bind_layers(py::module_& module, const std::string& suffix) {
  bind_products<T>(module, suffix);
  bind_norms<T>(module, suffix);
}
template void bind_layers<float>(py::module_&, const std::string&);
template void bind_layers<double>(py::module_&, const std::string&);

}  // namespace fieldmark::python
