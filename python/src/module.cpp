// The extension module: errors first, then engine, fields and marks.
#include "arrays.h"

namespace py = pybind11;

PYBIND11_MODULE(_fieldmark, module) {
  // Derives from Python's own exceptions, so that `except ValueError` and `except OSError` work as expected.
  py::register_exception<fieldmark::Error>(module, "Error", PyExc_RuntimeError);
  py::register_exception<fieldmark::ValueError>(module, "ValueError_", PyExc_ValueError);
  py::register_exception<fieldmark::ShapeError>(module, "ShapeError", PyExc_ValueError);
  py::register_exception<fieldmark::IoError>(module, "IoError", PyExc_OSError);
  fieldmark::python::bind_engine(module);
  fieldmark::python::bind_fields(module);
  fieldmark::python::bind_marks(module);
}
