// The extension module: errors first, then engine, fields and marks.
#include <exception>
#include <stdexcept>
#include <string>

#include "arrays.h"

namespace py = pybind11;

namespace {

// Before version 2.12, pybind11 reads NumPy 1's layout of dtypes, which is another in NumPy 2.
void require_known_numpy() {
#if PYBIND11_VERSION_HEX < 0x020C0000
  const auto version = py::module_::import("numpy").attr("__version__").cast<std::string>();
  if (std::stoi(version) >= 2)
    throw py::import_error("[fieldmark] this build needs NumPy 1, got " + version +
                           ": install \"numpy<2\", or build with pybind11 2.12 or later");
#endif
}

}  // namespace

PYBIND11_MODULE(_fieldmark, module) {
  require_known_numpy();
  // Each derives from one of Python's own exceptions too, so that `except ValueError` works as expected.
  const py::object error = py::register_exception<fieldmark::Error>(module, "Error", PyExc_RuntimeError);
  const py::tuple value_error = py::make_tuple(error, py::handle(PyExc_ValueError));
  py::register_exception<fieldmark::ValueError>(module, "ValueError_", value_error);
  py::register_exception<fieldmark::ShapeError>(module, "ShapeError", value_error);
  py::register_exception<fieldmark::IoError>(module, "IoError",
                                             py::make_tuple(error, py::handle(PyExc_OSError)));
  // Containers that could not be addressed; pybind11 would make them a ValueError with the container's own
  // text.
  py::register_local_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const std::length_error&) {
      PyErr_SetString(PyExc_MemoryError, "[fieldmark] more elements than memory can have");
    }
  });
  fieldmark::python::bind_engine(module);
  fieldmark::python::bind_fields(module);
  fieldmark::python::bind_marks(module);
  fieldmark::python::bind_refusals(module);
  fieldmark::python::bind_pickling_refusals(module);
}
