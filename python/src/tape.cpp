// Tapes and values: arrays in and out, operators, backward.
#include "tape_value.h"

#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/batched_matmul.h>
#include <fieldmark/engine/ops/operators.h>
#include <pybind11/stl.h>

namespace fieldmark::python {
namespace {

using namespace py::literals;

template <class T>
using ValueClass = py::class_<Value<T>>;

template <class T>
using TapePtr = std::shared_ptr<TapeHandle<T>>;

// Checks that a value belongs to this tape.
template <class T>
Var<T> own(const TapePtr<T>& t, const char* where, const Value<T>& v) {
  if (v.tape != t)
    throw py::value_error("[" + std::string(where) + "] the value was recorded on another tape");
  return v.get();
}

template <class T>
py::array zeros(const Shape& shape) {
  py::array_t<T> array(extents_of(shape));
  std::fill_n(array.mutable_data(), array.size(), T(0));
  return array;
}

template <class T>
Value<T> leaf(TapePtr<T> t, const py::object& given, const py::object& grad) {
  const py::array array = t->reads("leaf: array", given);
  py::array to = grad.is_none() ? zeros<T>(shape_of(array)) : borrowed<T>("leaf: grad", grad);
  if (shape_of(to) != shape_of(array))
    throw ShapeError("[leaf] grad must have the shape of the array, " + shape_of(array).str() + ", got " +
                     shape_of(to).str());
  if (!to.writeable())
    throw py::value_error(
        "[leaf: grad] must be writeable, since backward adds to it, got a read-only array: pass x.copy() or "
        "one "
        "that no pass reads");
  t->keep(array, to);
  return Value<T>(t, t->tape.leaf(static_cast<const T*>(array.data()), static_cast<T*>(to.mutable_data()),
                                  shape_of(array)));
}

// Returns numbers of a value's shape as an array: a view, or a copy if another object owns the tape, which
// then ends the pass while the array may live on.
template <class T>
py::array shown(const T* numbers, const Value<T>& v) {
  if (v.tape->own) return read_only_view(numbers, v.var.shape(), v.tape, v.tape->views);
  return py::array_t<T>(extents_of(v.var.shape()), numbers);
}

template <class T>
py::object grad_of(const Value<T>& v) {
  const T* grad = v.get().grad();
  if (!grad) return py::none();
  return shown(grad, v);
}

template <class T>
void backward(const Value<T>& v, const py::object& given) {
  const Var<T> var = v.get();
  v.tape->check_unchanged();
  if (given.is_none()) return v.tape->tape.backward(var);
  const py::array seed = borrowed<T>("backward: seed", given);
  if (shape_of(seed) != var.shape())
    throw ShapeError("[backward] seed must have the shape of the value, " + var.shape().str() + ", got " +
                     shape_of(seed).str());
  v.tape->tape.backward(var, elements<T>(seed));
}

template <class T>
T item(const Value<T>& v) {
  if (v.get().shape().size() != 1)
    throw ShapeError("[item] must have one element, got shape " + v.var.shape().str());
  return v.var.value()[0];
}

// Returns the other operand if it is a number.
template <class T>
double number(const char* op, const py::object& b) {
  const bool array = py::isinstance<py::array>(b);
  const double x = array ? 0 : PyFloat_AsDouble(b.ptr());
  if (!array && !PyErr_Occurred()) return x;
  PyErr_Clear();
  const std::string wanted = dtype_name<T>();
  throw py::type_error("[" + std::string(op) + "] must be a value of " + wanted + " or a number, got " +
                       type_name(b) + (array ? ": pass it as tape.constant(x)" : ""));
}

// Binds an operator on two values, or on a value and a number.
template <class T, class Number = T, class F>
auto operation(const char* op, F f) {
  return [op, f](const Value<T>& a, const py::object& b) {
    if (py::isinstance<Value<T>>(b)) return a.with(f(a.get(), b.cast<const Value<T>&>().get()));
    return a.with(f(a.get(), static_cast<Number>(number<T>(op, b))));
  };
}

template <class T>
void bind_operators(ValueClass<T>& value) {
  const auto add = [](auto a, auto b) { return a + b; };
  const auto multiply = [](auto a, auto b) { return a * b; };
  value.def("__add__", operation<T>("+", add), "other"_a)
      .def("__radd__", operation<T>("+", add), "other"_a)
      .def("__sub__", operation<T>("-", [](auto a, auto b) { return a - b; }), "other"_a)
      .def("__rsub__", operation<T>("-", [](auto a, auto b) { return b - a; }), "other"_a)
      .def("__mul__", operation<T>("*", multiply), "other"_a)
      .def("__rmul__", operation<T>("*", multiply), "other"_a)
      .def("__truediv__", operation<T>("/", [](auto a, auto b) { return a / b; }), "other"_a)
      .def("__rtruediv__", operation<T>("/", [](auto a, auto b) { return b / a; }), "other"_a)
      .def("__pow__", operation<T, double>("**", [](auto a, auto b) { return pow(a, b); }), "power"_a)
      .def("__neg__", [](const Value<T>& a) { return a.with(negate(a.get())); })
      .def(
          "__matmul__",
          [](const Value<T>& a, const py::object& b) {
            if (!py::isinstance<Value<T>>(b))
              throw py::type_error("[@] must be a value of " + std::string(dtype_name<T>()) + ", got " +
                                   type_name(b));
            return a.with(batched_matmul(a.get(), b.cast<const Value<T>&>().get()));
          },
          "other"_a);
  value.attr("__array_ufunc__") = py::none();  // numpy then defers array + value to __radd__
}

template <class T>
void bind_value(py::module_& module, const std::string& suffix) {
  ValueClass<T> value(module, ("Value_" + suffix).c_str(), "A value of a pass; it holds until Tape.reset().");
  value
      .def_property_readonly(
          "shape", [](const Value<T>& v) { return py::tuple(py::cast(extents_of(v.get().shape()))); })
      .def_property_readonly("dtype", [](const Value<T>&) { return py::dtype::of<T>(); })
      .def_property_readonly(
          "needs_grad", [](const Value<T>& v) { return v.get().needs_grad(); },
          "Whether it depends on a leaf, so that gradients reach it.")
      .def(
          "numpy", [](const Value<T>& v) { return shown(v.get().value(), v); },
          "The values, not copied (within gradcheck: a copy). While the array lives, the tape cannot be "
          "reset.")
      .def_property_readonly(
          "grad", &grad_of<T>,
          "The gradient that has arrived, not copied; None before there is one. ValueError for the "
          "output of a\nlayer with a ReLU, unless Tape.keep_grad() asked for it.")
      .def("item", &item<T>, "The only element, as a number.")
      .def("backward", &backward<T>, "seed"_a = py::none(),
           "Propagates gradients to the leaves; of more than one element, from a seed of its shape.")
      .def("__repr__", [](const Value<T>& v) {
        return std::string("<fieldmark value ") + v.get().shape().str() + " of " + dtype_name<T>() + ">";
      });
  bind_operators(value);
}

}  // namespace

template <class T>
void bind_tape(py::module_& module, const std::string& suffix) {
  bind_value<T>(module, suffix);
  py::class_<TapeHandle<T>, TapePtr<T>>(module, ("Tape_" + suffix).c_str(),
                                        "Records operations, and replays their gradients in reverse.")
      .def(py::init<>())
      .def_property_readonly("dtype", [](const TapeHandle<T>&) { return py::dtype::of<T>(); })
      .def(
          "constant",
          [](TapePtr<T> t, const py::object& given) {
            const py::array array = t->reads("constant: array", given);
            t->keep(array);
            return Value<T>(t, t->tape.constant(static_cast<const T*>(array.data()), shape_of(array)));
          },
          "array"_a,
          "A value that needs no gradient. The array is read in place, and read-only until reset().")
      .def("leaf", &leaf<T>, "array"_a, "grad"_a = py::none(),
           "A value to differentiate in: each backward adds its gradient to `grad`, zeros by default. The "
           "array\n"
           "is read in place, and read-only until reset().")
      .def(
          "name",
          [](const TapePtr<T>& t, const Value<T>& v, const std::string& name) {
            return v.with(t->tape.name(own(t, "Tape.name", v), name));
          },
          "value"_a, "name"_a,
          "Names a value for an inspector; without one it does nothing. Returns the value.")
      .def(
          "keep_grad",
          [](const TapePtr<T>& t, const Value<T>& v) {
            const Var<T> var = own(t, "Tape.keep_grad", v);
            static_cast<void>(var.grad());  // throws after a backward, when it is too late
            return v.with(t->tape.keep_grad(var));
          },
          "value"_a,
          "Has the next backward compute the gradient of a value that is the output of a layer with a ReLU.\n"
          "Returns the value.")
      .def(
          "reset", [](TapeHandle<T>& t) { t.reset(); },
          "Forgets the pass and keeps its memory. BufferError while arrays show values of the pass.");
}
template void bind_tape<float>(py::module_&, const std::string&);
template void bind_tape<double>(py::module_&, const std::string&);

}  // namespace fieldmark::python
