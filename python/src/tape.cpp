// Tapes and values: arrays in and out, operators, backward.
#include "tape_value.h"

#include <fieldmark/engine/dual/matrices.h>
#include <fieldmark/engine/dual/operators.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/batched_matmul.h>
#include <fieldmark/engine/ops/comparison.h>
#include <fieldmark/engine/ops/operators.h>
#include <pybind11/stl.h>

#include <cmath>
#include <limits>

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
  if (v.tape != t) throw ValueError("[" + std::string(where) + "] the value was recorded on another tape");
  return v.get(where);
}

template <class T>
py::array zeros(const Shape& shape) {
  py::array_t<T> array(extents_of(shape));
  std::fill_n(array.mutable_data(), array.size(), T(0));
  return array;
}

// Records an array that the pass may read.
template <class T>
Value<T> constant(const TapePtr<T>& t, const py::array& array) {
  Tape<T>& tape = t->tape();
  const Shape shape = shape_of(array);  // first: what is refused is not kept
  t->keep(array);
  return Value<T>(t, tape.constant(static_cast<const T*>(array.data()), shape));
}

template <class T>
Value<T> leaf(TapePtr<T> t, const py::object& given, const py::object& grad) {
  Tape<T>& tape = t->tape();
  const py::array array = t->reads("leaf: array", given);
  py::array to = grad.is_none() ? zeros<T>(shape_of(array)) : borrowed<T>("leaf: grad", grad);
  if (shape_of(to) != shape_of(array))
    throw ShapeError("[leaf] grad must have the shape of the array, " + shape_of(array).str() + ", got " +
                     shape_of(to).str());
  if (!to.writeable())
    throw ValueError(
        "[leaf: grad] must be writeable, since backward adds to it, got a read-only array: pass x.copy() or "
        "one "
        "that no pass reads");
  t->keep(array, to);
  return Value<T>(
      t, tape.leaf(static_cast<const T*>(array.data()), static_cast<T*>(to.mutable_data()), shape_of(array)));
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
  const T* grad = v.primal().grad();
  if (!grad) return py::none();
  return shown(grad, v);
}

template <class T>
void backward(const Value<T>& v, const py::object& given) {
  const Var<T> var = v.primal();
  v.tape->check_unchanged();
  if (given.is_none()) return v.tape->tape().backward(var);
  const py::array seed = borrowed<T>("backward: seed", given);
  if (shape_of(seed) != var.shape())
    throw ShapeError("[backward] seed must have the shape of the value, " + var.shape().str() + ", got " +
                     shape_of(seed).str());
  v.tape->tape().backward(var, elements<T>(seed));
}

template <class T>
T item(const Value<T>& v) {
  if (v.primal().shape().size() != 1)
    throw ShapeError("[item] must have one element, got shape " + v.var.shape().str());
  return v.primal().value()[0];
}

// Returns the other operand if it is a number.
template <class T>
double number(const char* op, const py::object& b) {
  const bool array = py::isinstance<py::array>(b);
  if (!array && !is_value(b)) {
    const double x = PyFloat_AsDouble(b.ptr());
    if (!PyErr_Occurred()) return x;
    if (!PyErr_ExceptionMatches(PyExc_TypeError)) throw py::error_already_set();
    PyErr_Clear();
  }
  const std::string wanted = dtype_name<T>();
  throw py::type_error("[" + std::string(op) + "] must be a value of " + wanted + " or a number, got " +
                       type_name(b) + (array ? ": pass it as tape.constant(x)" : ""));
}

// Returns the other operand if it is a number that T can hold.
template <class T>
T number_of(const char* op, const py::object& b) {
  const double x = number<T>(op, b);
  if (std::isfinite(x) && std::abs(x) > static_cast<double>(std::numeric_limits<T>::max()))
    throw ValueError("[" + std::string(op) + "] must be a number within the range of " + dtype_name<T>() +
                     ", got " + py::repr(b).cast<std::string>());
  return static_cast<T>(x);
}

// Binds an operator on two values, or on a value and a number.
template <class T, class F>
auto operation(const char* op, F f) {
  return [op, f](const Value<T>& a, const py::object& b) {
    if (py::isinstance<Value<T>>(b)) return a.with(on(f, a, b.cast<const Value<T>&>()));
    const T x = number_of<T>(op, b);
    return a.with(on([&](auto v) { return f(v, x); }, a));
  };
}

// Binds a comparison of a value with a value or a number.
template <class T>
auto comparison(const char* op, Var<T> (*compare)(Var<T>, Var<T>)) {
  return [op, compare](const Value<T>& a, const py::object& b) {
    if (py::isinstance<Value<T>>(b)) return a.with(compare(a.primal(), b.cast<const Value<T>&>().primal()));
    py::array_t<T> one(std::vector<py::ssize_t>{});
    *one.mutable_data() = number_of<T>(op, b);
    return a.with(compare(a.primal(), constant(a.tape, one).primal()));
  };
}

// Binds what Python would otherwise answer with the identity of the object.
template <class T>
void bind_meaningless(ValueClass<T>& value) {
  const auto refuse = [](const char* text) {
    return [text](const Value<T>&) -> py::object { throw py::type_error(text); };
  };
  const auto refuse_other = [](const char* text) {
    return [text](const Value<T>&, const py::object&) -> py::object { throw py::type_error(text); };
  };
  value.attr("__hash__") = py::module_::import("builtins").attr("object").attr("__hash__");
  value.def("__eq__", refuse_other("[==] does not compare values: use engine.equal(a, b)"), "other"_a)
      .def("__ne__", refuse_other("[!=] does not compare values: use 1 - engine.equal(a, b)"), "other"_a)
      .def("__bool__", refuse("[bool] a value is neither true nor false: use its number, value.item()"))
      .def("__array__", [](const Value<T>&, const py::args&, const py::kwargs&) -> py::object {
        throw py::type_error("[numpy] a value is not an array: pass value.numpy()");
      });
}

// Values to the power of values, or of a number, which stays a double.
template <class T>
Value<T> power(const Value<T>& a, const py::object& b) {
  if (py::isinstance<Value<T>>(b))
    return a.with(on([](auto u, auto v) { return pow(u, v); }, a, b.cast<const Value<T>&>()));
  const double p = number<T>("**", b);
  return a.with(on([&](auto v) { return pow(v, p); }, a));
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
      .def("__pow__", power<T>, "power"_a)
      .def("__neg__", [](const Value<T>& a) { return a.with(on([](auto v) { return negate(v); }, a)); })
      .def(
          "__matmul__",
          [](const Value<T>& a, const py::object& b) {
            return a.with(on([](auto u, auto v) { return batched_matmul(u, v); }, a, value_of<T>("@", b)));
          },
          "other"_a)
      .def("__lt__", comparison<T>("<", less<T>), "other"_a, "1 where a < b, else 0; no gradient passes.")
      .def("__gt__", comparison<T>(">", greater<T>), "other"_a, "1 where a > b, else 0; no gradient passes.");
  value.attr("__array_ufunc__") = py::none();  // numpy then defers array + value to __radd__
}

template <class T>
void bind_value(py::module_& module, const std::string& suffix) {
  ValueClass<T> value(module, ("Value_" + suffix).c_str(), "A value of a pass; it holds until Tape.reset().");
  value
      .def_property_readonly(
          "shape", [](const Value<T>& v) { return py::tuple(py::cast(extents_of(v.primal().shape()))); },
          "Extents of the axes, a tuple.")
      .def_property_readonly(
          "dtype", [](const Value<T>&) { return py::dtype::of<T>(); }, "float32 or float64.")
      .def_property_readonly(
          "tape", [](const Value<T>& v) { return v.tape; }, "The tape that recorded it.")
      .def_property_readonly(
          "needs_grad", [](const Value<T>& v) { return v.primal().needs_grad(); },
          "Whether it depends on a leaf, so that gradients reach it.")
      .def(
          "numpy", [](const Value<T>& v) { return shown(v.primal().value(), v); },
          "The values, not copied (within gradcheck: a copy). While the array lives, the tape cannot be "
          "reset.")
      .def_property_readonly(
          "grad", &grad_of<T>,
          "The gradient that has arrived, not copied. Of a leaf, it is the sum over all backwards, zeros "
          "before "
          "the\nfirst; of any other value it is that of the last backward, None before the first, and of a "
          "constant "
          "None.\nThe array is a view of the tape's memory: the next backward overwrites it, so copy what "
          "you want to "
          "keep.\nValueError for the output of a layer with a ReLU, unless Tape.keep_grad() asked for it.")
      .def("item", &item<T>, "The only element, as a number. ShapeError if there are more, or none.")
      .def("__float__", &item<T>)
      .def("backward", &backward<T>, "seed"_a = py::none(),
           "Adds the gradients of this value to those of the leaves.\n\n"
           "Gradients of leaves add up over backwards, those of other values start anew; arrays from an "
           "earlier\n"
           "`grad` show the new ones. A value of more than one element needs a seed, an array of its shape.\n"
           "ShapeError without it, ValueError if parameters have changed since the pass read them.")
      .def("__repr__", [](const Value<T>& v) {
        if (v.pass != v.tape->pass)
          return std::string("<fieldmark value of ") + dtype_name<T>() + ", forgotten by Tape.reset()>";
        return std::string("<fieldmark value ") + v.primal().shape().str() + " of " + dtype_name<T>() + ">";
      });
  bind_operators(value);
  bind_meaningless(value);
}

}  // namespace

template <class T>
void bind_tape(py::module_& module, const std::string& suffix) {
  py::class_<TapeHandle<T>, TapePtr<T>> tape(module, ("Tape_" + suffix).c_str(),
                                             "Records operations, and replays their gradients in reverse.");
  bind_value<T>(module, suffix);  // its property `tape` needs the class
  tape.def(py::init<>())
      .def_property_readonly(
          "dtype", [](const TapeHandle<T>&) { return py::dtype::of<T>(); }, "float32 or float64.")
      .def(
          "constant",
          [](TapePtr<T> t, const py::object& given) {
            const py::array array = t->reads("constant: array", given);
            return constant(t, array);
          },
          "array"_a,
          "A value that needs no gradient. The array is read in place, and read-only until reset().")
      .def("leaf", &leaf<T>, "array"_a, "grad"_a = py::none(),
           "A value to differentiate in: each backward adds its gradient to `grad`, zeros by default. The "
           "array\n"
           "is read in place, and read-only until reset().")
      .def(
          "name",
          [](const TapePtr<T>& t, const py::object& given, const std::string& name) {
            const Value<T>& v = value_of<T>("Tape.name: value", given);
            return v.with(t->tape().name(own(t, "Tape.name", v), name));
          },
          "value"_a, "name"_a,
          "Names a value for an inspector; without one it does nothing. Returns the value.")
      .def(
          "keep_grad",
          [](const TapePtr<T>& t, const py::object& given) {
            const Value<T>& v = value_of<T>("Tape.keep_grad: value", given);
            const Var<T> var = own(t, "Tape.keep_grad", v);
            static_cast<void>(var.grad());  // throws after a backward, when it is too late
            return v.with(t->tape().keep_grad(var));
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
