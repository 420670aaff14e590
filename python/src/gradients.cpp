// Functions of Python under differentiation: gradient checks and products with Jacobians.
#include <fieldmark/engine/gradcheck.h>
#include <fieldmark/engine/products.h>
#include <pybind11/stl.h>

#include <cstdio>
#include <optional>

#include "tape_value.h"

namespace fieldmark::python {
namespace {

using namespace py::literals;

// The inputs, Vars or Duals, as values of the engine's own tape, which forgets them when the call ends.
template <class T>
class TapedFunction {
 public:
  TapedFunction(const char* where, py::function f) : where_(where), f_(std::move(f)) {}
  ~TapedFunction() { forget(); }
  TapedFunction(const TapedFunction&) = delete;
  TapedFunction& operator=(const TapedFunction&) = delete;
  Var<T> operator()(Tape<T>& tape, std::span<const Var<T>> xs) {
    return result_of(std::make_shared<TapeHandle<T>>(tape), xs).value();
  }
  Dual<T> operator()(Tape<T>& tape, std::span<const Dual<T>> xs) {
    return result_of(std::make_shared<TapeHandle<T>>(tape), xs);
  }
  // As above, with computed parameters of a store.
  Var<T> operator()(Tape<T>& tape, const ParamStore<T>& store, const Params<T>& computed,
                    std::span<const Var<T>> xs) {
    return result_of(std::make_shared<TapeHandle<T>>(tape, store, computed), xs).value();
  }

 private:
  template <class X>
  Dual<T> result_of(std::shared_ptr<TapeHandle<T>> handle, std::span<const X> xs) {
    forget();                     // the engine has reset the tape
    handle_ = std::move(handle);  // backward reads what the handle keeps
    py::list values;
    for (const X& x : xs) values.append(Value<T>(handle_, x));
    const py::object y = f_(*values);
    if (!py::isinstance<Value<T>>(y))
      throw py::type_error("[" + std::string(where_) + "] f must return a value of " + dtype_name<T>() +
                           ", got " + type_name(y));
    return y.cast<const Value<T>&>().dual();
  }
  void forget() {
    if (handle_) handle_->end();
  }
  const char* where_;
  py::function f_;
  std::shared_ptr<TapeHandle<T>> handle_;
};

template <class T>
Tensor<T> tensor_from(const std::string& where, const py::object& given) {
  const py::array array = borrowed<T>(where, given);
  Tensor<T> tensor(shape_of(array));
  std::ranges::copy(elements<T>(array), tensor.data.begin());
  return tensor;
}

template <class T>
std::vector<Tensor<T>> tensors_from(const std::string& where, const std::vector<py::object>& given) {
  std::vector<Tensor<T>> tensors;
  for (const py::object& each : given) tensors.push_back(tensor_from<T>(where + ": each", each));
  return tensors;
}

template <class T>
py::array array_from(const Tensor<T>& tensor) {
  return py::array_t<T>(extents_of(tensor.shape), tensor.data.data());
}

using Checked = std::shared_ptr<StoreHandle<double>>;

GradcheckReport check_gradients(const py::function& f, const std::vector<py::object>& inputs, double rtol,
                                const std::optional<Checked>& parameters) {
  if (inputs.empty() && !parameters) throw ValueError("[gradcheck] inputs must not be empty");
  const auto tensors = tensors_from<double>("gradcheck: inputs", inputs);
  TapedFunction<double> taped("gradcheck", f);
  if (!parameters) return gradcheck(std::ref(taped), tensors, {.rtol = rtol});
  const ParamStore<double>& store = (*parameters)->store;
  const py::capsule lease = (*parameters)->leases.lend(*parameters);  // f must not add parameters
  return gradcheck_module([&](Tape<double>& tape, const Params<double>& computed,
                              std::span<const Var<double>> xs) { return taped(tape, store, computed, xs); },
                          store, tensors, {.rtol = rtol});
}

// Whether the first of the arrays is of float32; the others then must be, too.
bool are_float32(const char* where, const std::vector<py::object>& arrays) {
  if (arrays.empty()) throw ValueError("[" + std::string(where) + "] inputs must not be empty");
  return py::isinstance<py::array>(arrays.front()) &&
         py::reinterpret_borrow<py::array>(arrays.front()).dtype().equal(py::dtype::of<float>());
}

template <class T>
py::list arrays_from(const std::vector<Tensor<T>>& tensors) {
  py::list arrays;
  for (const Tensor<T>& tensor : tensors) arrays.append(array_from(tensor));
  return arrays;
}

template <class T>
py::tuple vjp_of(const py::function& f, const std::vector<py::object>& inputs, const py::object& cotangent) {
  const auto tensors = tensors_from<T>("vjp: inputs", inputs);
  const Tensor<T> u = tensor_from<T>("vjp: cotangent", cotangent);
  TapedFunction<T> taped("vjp", f);
  const auto found = vjp<T>(std::ref(taped), std::span<const Tensor<T>>(tensors), u);
  return py::make_tuple(array_from(found.value), arrays_from(found.products));
}

template <class T>
py::tuple jvp_of(const py::function& f, const std::vector<py::object>& inputs,
                 const std::vector<py::object>& tangents) {
  const auto tensors = tensors_from<T>("jvp: inputs", inputs), v = tensors_from<T>("jvp: tangents", tangents);
  TapedFunction<T> taped("jvp", f);
  const auto found =
      jvp<T>(std::ref(taped), std::span<const Tensor<T>>(tensors), std::span<const Tensor<T>>(v));
  return py::make_tuple(array_from(found.value), array_from(found.product));
}

template <class T>
py::tuple hvp_of(const py::function& f, const std::vector<py::object>& inputs,
                 const std::vector<py::object>& directions) {
  const auto tensors = tensors_from<T>("hvp: inputs", inputs),
             v = tensors_from<T>("hvp: directions", directions);
  TapedFunction<T> taped("hvp", f);
  const auto found =
      hvp<T>(std::ref(taped), std::span<const Tensor<T>>(tensors), std::span<const Tensor<T>>(v));
  return py::make_tuple(array_from(found.value), arrays_from(found.products));
}

void bind_report(py::module_& module) {
  py::class_<GradcheckReport>(module, "GradcheckReport", "What gradcheck() found; true if no entry is bad.")
      .def_readonly("ok", &GradcheckReport::ok, "Whether no entry is bad.")
      .def_readonly("worst", &GradcheckReport::worst, "Largest relative error.")
      .def_readonly("entries", &GradcheckReport::entries, "Entries compared.")
      .def_readonly("table", &GradcheckReport::table, "One line per bad entry.")
      .def(
          "__bool__", [](const GradcheckReport& r) { return r.ok; }, "Whether no entry is bad, as ok.")
      .def("__repr__", [](const GradcheckReport& r) {
        char text[120];
        std::snprintf(text, sizeof text, "<fieldmark gradcheck, %s: worst error %.3g of %lld entries>",
                      r.ok ? "ok" : "failed", r.worst, static_cast<long long>(r.entries));
        return std::string(text);
      });
}

}  // namespace

void bind_gradients(py::module_& module) {
  bind_report(module);
  module.def(
      "gradcheck", &check_gradients, "f"_a, "inputs"_a, "rtol"_a = 1e-7, "parameters"_a = py::none(),
      "Compares gradients with finite differences, in float64; those of `parameters`, too, which f reads "
      "through\n"
      "layers or leaf(). Adds to the gradients of other parameters that layers of f read. ValueError unless\n"
      "0 < rtol < 1.");
  module.def(
      "vjp",
      [](const py::function& f, const std::vector<py::object>& inputs, const py::object& cotangent) {
        return are_float32("vjp", inputs) ? vjp_of<float>(f, inputs, cotangent)
                                          : vjp_of<double>(f, inputs, cotangent);
      },
      "f"_a, "inputs"_a, "cotangent"_a,
      "The value f(x) and, for each input, the vector-Jacobian product J^T u of its shape, u the cotangent.\n"
      "ShapeError unless u has the shape of f(x). Adds to the gradients of parameters that layers of f "
      "read.");
  using Arrays = const std::vector<py::object>&;
  module.def(
      "jvp",
      [](const py::function& f, Arrays inputs, Arrays tangents) {
        return are_float32("jvp", inputs) ? jvp_of<float>(f, inputs, tangents)
                                          : jvp_of<double>(f, inputs, tangents);
      },
      "f"_a, "inputs"_a, "tangents"_a,
      "The value f(x) and the Jacobian-vector product J v of its shape, v the tangents, one per input.\n"
      "ShapeError if a shape differs, ValueError if the numbers do, TypeError for an op without a tangent.");
  module.def(
      "hvp",
      [](const py::function& f, Arrays inputs, Arrays directions) {
        return are_float32("hvp", inputs) ? hvp_of<float>(f, inputs, directions)
                                          : hvp_of<double>(f, inputs, directions);
      },
      "f"_a, "inputs"_a, "directions"_a,
      "The value f(x) of one element and, for each input, the Hessian-vector product H v of its shape, v "
      "the\n"
      "directions, one per input. Errors as of jvp().");
}

}  // namespace fieldmark::python
