// The engine: tapes, values, parameters, optimisers, gradient checks. The ops are in ops.cpp.
#include <fieldmark/engine/clip.h>
#include <fieldmark/engine/gradcheck.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/batched_matmul.h>
#include <fieldmark/engine/ops/operators.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/tensor_stats.h>
#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include "tape_value.h"

namespace fieldmark::python {
namespace {

using namespace py::literals;

template <class T>
using TapeClass = py::class_<TapeHandle<T>, std::shared_ptr<TapeHandle<T>>>;
template <class T>
using ValueClass = py::class_<Value<T>>;

template <class T>
void bind_tape(py::module_& module, const std::string& suffix) {
  TapeClass<T>(module, ("Tape_" + suffix).c_str())
      .def(py::init<>())
      .def_property_readonly("dtype", [](const TapeHandle<T>&) { return py::dtype::of<T>(); })
      .def(
          "constant",
          [](std::shared_ptr<TapeHandle<T>> t, const py::object& given) {
            const py::array array = borrowed<T>("constant: array", given);
            t->inputs.push_back(array);
            return Value<T>(t, t->tape.constant(static_cast<const T*>(array.data()), shape_of(array)));
          },
          "array"_a, "A value that needs no gradient. The array is read in place.")
      .def(
          "leaf",
          [](std::shared_ptr<TapeHandle<T>> t, const py::object& given, const py::object& grad) {
            const py::array array = borrowed<T>("leaf: array", given);
            py::array to = grad.is_none() ? py::array(py::module_::import("numpy").attr("zeros_like")(array))
                                          : borrowed<T>("leaf: grad", grad);
            if (shape_of(to) != shape_of(array))
              throw ShapeError("[leaf] grad must have the shape of the array, " + shape_of(array).str() +
                               ", got " + shape_of(to).str());
            t->inputs.push_back(array);
            t->inputs.push_back(to);
            return Value<T>(t, t->tape.leaf(static_cast<const T*>(array.data()),
                                            static_cast<T*>(to.mutable_data()), shape_of(array)));
          },
          "array"_a, "grad"_a = py::none(),
          "A value to differentiate in: each backward adds its gradient to `grad`, zeros by default.")
      .def(
          "reset", [](TapeHandle<T>& t) { t.reset(); },
          "Forgets the pass and keeps its memory. BufferError while arrays show values of the pass.");
}

template <class T>
py::object grad_of(const Value<T>& v) {
  const T* grad = v.get().grad();
  if (!grad) return py::none();
  return read_only_view(grad, v.var.shape(), v.tape, v.tape->views);
}

template <class T>
void backward(const Value<T>& v, const py::object& seed) {
  if (seed.is_none()) return v.tape->tape.backward(v.get());
  v.tape->tape.backward(v.get(), elements<T>(borrowed<T>("backward: seed", seed)));
}

// Operators of two values, and of a value and a number.
template <class T>
void bind_operators(ValueClass<T>& value) {
  using V = const Value<T>&;
  value.def("__add__", [](V a, V b) { return a.with(a.get() + b.get()); })
      .def("__add__", [](V a, T b) { return a.with(a.get() + b); })
      .def("__radd__", [](V a, T b) { return a.with(a.get() + b); })
      .def("__sub__", [](V a, V b) { return a.with(a.get() - b.get()); })
      .def("__sub__", [](V a, T b) { return a.with(a.get() - b); })
      .def("__rsub__", [](V a, T b) { return a.with(b - a.get()); })
      .def("__mul__", [](V a, V b) { return a.with(a.get() * b.get()); })
      .def("__mul__", [](V a, T b) { return a.with(a.get() * b); })
      .def("__rmul__", [](V a, T b) { return a.with(a.get() * b); })
      .def("__truediv__", [](V a, V b) { return a.with(a.get() / b.get()); })
      .def("__truediv__", [](V a, T b) { return a.with(a.get() / b); })
      .def("__rtruediv__", [](V a, T b) { return a.with(b / a.get()); })
      .def("__pow__", [](V a, V b) { return a.with(pow(a.get(), b.get())); })
      .def("__pow__", [](V a, double p) { return a.with(pow(a.get(), p)); })
      .def("__neg__", [](V a) { return a.with(negate(a.get())); })
      .def("__matmul__", [](V a, V b) { return a.with(batched_matmul(a.get(), b.get())); });
}

template <class T>
void bind_value(py::module_& module, const std::string& suffix) {
  ValueClass<T> value(module, ("Value_" + suffix).c_str());
  value
      .def_property_readonly(
          "shape", [](const Value<T>& v) { return py::tuple(py::cast(extents_of(v.get().shape()))); })
      .def_property_readonly("dtype", [](const Value<T>&) { return py::dtype::of<T>(); })
      .def_property_readonly("needs_grad", [](const Value<T>& v) { return v.get().needs_grad(); })
      .def(
          "numpy",
          [](const Value<T>& v) {
            return read_only_view(v.get().value(), v.var.shape(), v.tape, v.tape->views);
          },
          "The values, not copied. While the array lives, the tape cannot be reset.")
      .def_property_readonly("grad", &grad_of<T>,
                             "The gradient that has arrived, not copied; None before there is one.")
      .def(
          "item",
          [](const Value<T>& v) {
            if (v.get().shape().size() != 1)
              throw ShapeError("[item] must have one element, got shape " + v.var.shape().str());
            return v.var.value()[0];
          },
          "The only element, as a number.")
      .def("backward", &backward<T>, "seed"_a = py::none(),
           "Propagates gradients to the leaves; of more than one element, from a seed of its shape.")
      .def("__repr__", [](const Value<T>& v) {
        return std::string("<fieldmark value ") + v.get().shape().str() + " of " + dtype_name<T>() + ">";
      });
  bind_operators(value);
}

// name -> {"count": ..., "mean": ...}
py::dict as_dict(const std::vector<TensorStats>& all) {
  py::dict named;
  for (const TensorStats& s : all)
    named[py::str(s.name)] = py::dict("count"_a = s.count, "zeros"_a = s.zeros, "nonfinite"_a = s.nonfinite,
                                      "mean"_a = s.mean, "rms"_a = s.rms, "largest"_a = s.largest);
  return named;
}

template <class T>
void bind_parameters(py::module_& module, const std::string& suffix) {
  using Store = StoreHandle<T>;
  using StorePtr = std::shared_ptr<Store>;
  py::class_<Store, StorePtr>(module, ("Parameters_" + suffix).c_str())
      .def(py::init<>())
      .def(
          "add", [](Store& s, const std::string& name, const py::object& values) { s.add(name, values); },
          "name"_a, "values"_a, "Adds a tensor with these values, which are copied.")
      .def(
          "names",
          [](const Store& s) {
            std::vector<std::string> names;
            for (const auto& e : s.store.entries()) names.push_back(e.name);
            return names;
          },
          "All names in the order added.")
      .def(
          "values",
          [](StorePtr s, const std::string& name) {
            const ParamId id = s->store.find(name);
            return view(s->store.values(id).data(), s->store.entry(id).shape, s, s->leases);
          },
          "name"_a, "The values of a tensor, not copied; writing changes the model.")
      .def(
          "grads",
          [](StorePtr s, const std::string& name) {
            const ParamId id = s->store.find(name);
            return view(s->store.grads(id).data(), s->store.entry(id).shape, s, s->leases);
          },
          "name"_a, "The gradients of a tensor, not copied.")
      .def(
          "leaf",
          [](StorePtr s, std::shared_ptr<TapeHandle<T>> tape, const std::string& name) {
            const ParamId id = s->store.find(name);
            tape->inputs.push_back(s->leases.lend(s));
            return Value<T>(tape, Params<T>(s->store).leaf(tape->tape, id));
          },
          "tape"_a, "name"_a, "A parameter on a tape.")
      .def("zero_grad", [](Store& s) { s.store.zero_grad(); })
      .def(
          "gradient_stats", [](Store& s) { return as_dict(gradient_stats(s.store)); },
          "Statistics of each gradient by name: count, zeros, nonfinite, and mean, rms and largest magnitude "
          "of what is finite.")
      .def(
          "value_stats", [](const Store& s) { return as_dict(value_stats(s.store)); },
          "The same statistics of the values.")
      .def(
          "clip_grad_norm", [](Store& s, double limit) { return clip_grad_norm(s.store, limit); }, "limit"_a,
          "Scales all gradients down to this norm; returns the norm that they had.");
}

// An optimiser and the store that it moves.
template <class T, class O>
struct OptimiserHandle {
  std::shared_ptr<StoreHandle<T>> store;
  py::capsule lease;  // the store takes no more parameters
  O optimiser;
  void step(double factor) { optimiser.step(store->store.values(), store->store.grads(), factor); }
};

template <class T>
void bind_optimisers(py::module_& module, const std::string& suffix) {
  using StorePtr = std::shared_ptr<StoreHandle<T>>;
  using AdamHandle = OptimiserHandle<T, Adam<T>>;
  using SgdHandle = OptimiserHandle<T, Sgd<T>>;
  py::class_<AdamHandle>(module, ("Adam_" + suffix).c_str())
      .def(py::init([](StorePtr s, double lr, double beta1, double beta2, double eps, double weight_decay) {
             return new AdamHandle{
                 s, s->leases.lend(s),
                 Adam<T>(
                     s->store,
                     {.lr = lr, .beta1 = beta1, .beta2 = beta2, .eps = eps, .weight_decay = weight_decay})};
           }),
           "parameters"_a, "lr"_a = 1e-3, "beta1"_a = 0.9, "beta2"_a = 0.999, "eps"_a = 1e-8,
           "weight_decay"_a = 0.0)
      .def("step", &AdamHandle::step, "lr_factor"_a = 1.0);
  py::class_<SgdHandle>(module, ("Sgd_" + suffix).c_str())
      .def(
          py::init([](StorePtr s, double lr, double momentum, bool nesterov, double weight_decay) {
            return new SgdHandle{
                s, s->leases.lend(s),
                Sgd<T>(s->store,
                       {.lr = lr, .momentum = momentum, .nesterov = nesterov, .weight_decay = weight_decay})};
          }),
          "parameters"_a, "lr"_a = 1e-2, "momentum"_a = 0.0, "nesterov"_a = false, "weight_decay"_a = 0.0)
      .def("step", &SgdHandle::step, "lr_factor"_a = 1.0);
}

template <class T>
void bind_engine_of(py::module_& module, const std::string& suffix) {
  bind_tape<T>(module, suffix);
  bind_value<T>(module, suffix);
  bind_ops<T>(module);
  bind_parameters<T>(module, suffix);
  bind_optimisers<T>(module, suffix);
}

// The inputs as values of gradcheck()'s own tape, which forgets them when the check ends.
class CheckedFunction {
 public:
  explicit CheckedFunction(py::function f) : f_(std::move(f)) {}
  ~CheckedFunction() {
    for (const auto& handle : handles_) ++handle->pass;
  }
  CheckedFunction(const CheckedFunction&) = delete;
  CheckedFunction& operator=(const CheckedFunction&) = delete;
  Var<double> operator()(Tape<double>& tape, std::span<const Var<double>> xs) {
    handles_.push_back(std::make_shared<TapeHandle<double>>(tape));  // a backward reads what it keeps
    py::list values;
    for (const Var<double>& x : xs) values.append(Value<double>(handles_.back(), x));
    return f_(*values).cast<Value<double>>().get();
  }

 private:
  py::function f_;
  std::vector<std::shared_ptr<TapeHandle<double>>> handles_;
};

GradcheckReport check_gradients(const py::function& f, const std::vector<py::object>& inputs, double rtol) {
  std::vector<Tensor<double>> tensors;
  for (const py::object& given : inputs) {
    const py::array array = borrowed<double>("gradcheck: inputs: each", given);
    const auto numbers = elements<double>(array);
    tensors.emplace_back(shape_of(array));
    std::ranges::copy(numbers, tensors.back().data.begin());
  }
  CheckedFunction checked(f);
  return gradcheck(std::ref(checked), tensors, {.rtol = rtol});
}

}  // namespace

void bind_engine(py::module_& module) {
  bind_engine_of<float>(module, "float32");
  bind_engine_of<double>(module, "float64");
  py::class_<GradcheckReport>(module, "GradcheckReport")
      .def_readonly("ok", &GradcheckReport::ok)
      .def_readonly("worst", &GradcheckReport::worst)
      .def_readonly("entries", &GradcheckReport::entries)
      .def_readonly("table", &GradcheckReport::table);
  module.def("gradcheck", &check_gradients, "f"_a, "inputs"_a, "rtol"_a = 1e-7);
  module.def("threads", &threads);
  module.def("set_threads", &set_threads, "count"_a);
}

}  // namespace fieldmark::python
