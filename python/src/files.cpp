// Named arrays of safetensors files.
#include <fieldmark/engine/safetensors.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cstring>

#include "arrays.h"

namespace fieldmark::python {
namespace {

using namespace py::literals;

// The types of a file's elements that NumPy has too. BF16 is widened.
constexpr std::pair<const char*, const char*> kTypes[] = {
    {"F64", "float64"}, {"F32", "float32"}, {"F16", "float16"}, {"I64", "int64"},
    {"I32", "int32"},   {"I16", "int16"},   {"I8", "int8"},     {"U64", "uint64"},
    {"U32", "uint32"},  {"U16", "uint16"},  {"U8", "uint8"},    {"BOOL", "bool"}};

py::array get(const SafetensorsFile& file, const std::string& name) {
  const SafetensorsFile::Entry& entry = file.at(name);
  if (entry.dtype == "BF16") {
    const Tensor<float> widened = file.f32(name);
    return py::array_t<float>(extents_of(widened.shape), widened.data.data());
  }
  for (const auto& [dtype, numpy] : kTypes) {
    if (entry.dtype != dtype) continue;
    py::array array(py::dtype(numpy), extents_of(entry.shape));
    if (!entry.data.empty()) std::memcpy(array.mutable_data(), entry.data.data(), entry.data.size());
    return array;
  }
  throw IoError("[SafetensorsFile.get] array '" + name + "' must have a type that NumPy has, got " +
                entry.dtype);
}

// Adds the array if its elements are of type U.
template <class U>
bool add_as(SafetensorsFile& file, const std::string& name, const py::array& given) {
  if (!given.dtype().equal(py::dtype::of<U>())) return false;
  const auto array = py::array_t<U, py::array::c_style | py::array::forcecast>::ensure(given);
  file.add(name, shape_of(array), elements<U>(array));
  return true;
}

void add(SafetensorsFile& file, const std::string& name, const py::object& given) {
  if (!py::isinstance<py::array>(given))
    throw py::type_error("[SafetensorsFile.add: array] must be a numpy array, got " + type_name(given));
  if (py::hasattr(given, "mask"))
    throw py::type_error("[SafetensorsFile.add: array] must not be masked: pass x.filled(value)");
  const auto array = py::reinterpret_borrow<py::array>(given);
  const bool added = add_as<float>(file, name, array) || add_as<double>(file, name, array) ||
                     add_as<std::uint8_t>(file, name, array) || add_as<std::int32_t>(file, name, array) ||
                     add_as<std::int64_t>(file, name, array) || add_as<std::uint64_t>(file, name, array);
  if (!added)
    throw py::type_error(
        "[SafetensorsFile.add: array] must be of float32, float64, uint8, int32, int64 or "
        "uint64, got " +
        py::str(array.dtype()).cast<std::string>());
}

}  // namespace

void bind_files(py::module_& module) {
  py::class_<SafetensorsFile>(module, "SafetensorsFile", "Named arrays of a safetensors file.")
      .def(py::init<>())
      .def_static("read", &SafetensorsFile::read, "path"_a,
                  "Reads and checks a whole file. IoError if it cannot be read or is not valid.")
      .def(
          "write", [](const SafetensorsFile& f, const std::filesystem::path& path) { f.write(path); },
          "path"_a, "Writes the file whole or not at all. IoError if that fails.")
      .def(
          "names",
          [](const SafetensorsFile& f) {
            std::vector<std::string> names;
            for (const auto& e : f.tensors) names.push_back(e.name);
            return names;
          },
          "Names of the arrays, in the order of the file.")
      .def("get", &get, "name"_a,
           "A copy of an array, of its own type; bfloat16 is widened to float32. IoError if there is none of "
           "this\n"
           "name; the text lists the names.")
      .def("add", &add, "name"_a, "array"_a,
           "Adds a copy of an array of float32, float64, uint8, int32, int64 or uint64. ValueError if the "
           "name is\n"
           "taken, TypeError for another type.")
      .def_property_readonly(
          "metadata", [](const SafetensorsFile& f) { return f.metadata; },
          "The strings of the file by key, a copy.")
      .def(
          "set_metadata",
          [](SafetensorsFile& f, const std::string& key, const std::string& text) { f.metadata[key] = text; },
          "key"_a, "text"_a, "Adds a string to the metadata, or replaces the one of this key.");
}

}  // namespace fieldmark::python
