#pragma once
#include <string_view>

#include "tape_value.h"

namespace fieldmark::python {

/// An op's argument that is a number. Values are refused: converted to a number, they would pass no gradient.
struct Number {
  double value = 0;
  operator double() const { return value; }  // NOLINT(google-explicit-constructor): it stands for a double
};

/// An argument that is True or False. Anything else is refused: pybind11 would take None and 0.5, too.
struct Flag {
  bool value = false;
  operator bool() const { return value; }  // NOLINT(google-explicit-constructor): it stands for a bool
};

}  // namespace fieldmark::python

namespace pybind11::detail {

template <>
struct type_caster<fieldmark::python::Flag> {
  PYBIND11_TYPE_CASTER(fieldmark::python::Flag, const_name("bool"));
  bool load(handle given, bool) {
    const bool numpy = std::string_view(Py_TYPE(given.ptr())->tp_name).starts_with("numpy.bool");
    if (!PyBool_Check(given.ptr()) && !numpy) return false;
    value.value = PyObject_IsTrue(given.ptr()) == 1;
    return true;
  }
  static handle cast(const fieldmark::python::Flag& flag, return_value_policy, handle) {
    return PyBool_FromLong(flag.value);
  }
};

template <>
struct type_caster<fieldmark::python::Number> {
  PYBIND11_TYPE_CASTER(fieldmark::python::Number, const_name("float"));
  bool load(handle given, bool convert) {
    type_caster<double> number;
    if (fieldmark::python::is_value(given) || !number.load(given, convert)) return false;
    value.value = number;
    return true;
  }
  static handle cast(const fieldmark::python::Number& number, return_value_policy, handle) {
    return PyFloat_FromDouble(number);
  }
};

}  // namespace pybind11::detail
