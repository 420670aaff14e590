#pragma once
#include "tape_value.h"

namespace fieldmark::python {

/// An op's argument that is a number. Values are refused: converted to a number, they would pass no gradient.
struct Number {
  double value = 0;
  operator double() const { return value; }  // NOLINT(google-explicit-constructor): it stands for a double
};

}  // namespace fieldmark::python

namespace pybind11::detail {

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
