// Why an object cannot be pickled or copied, and the alternative; Parameters can.
#include <string>
#include <string_view>

#include "arrays.h"

namespace fieldmark::python {
namespace {

struct Advice {
  std::string_view kinds;  // names of classes without their scalar type, each between spaces
  const char* text;
};
constexpr Advice kAdvice[] = {
    {" Field Key Owner ", "use its save(path), and load(path) of its class"},
    {" Camera ", "make it anew from its pose, field of view and size"},
    {" Adam Sgd Muon ", "use save_state() and load_state() with a SafetensorsFile"},
    {" Dense Conv2d BatchNorm GroupNorm LayerNorm Embedding ",
     "make the layer anew, and save and load its parameters with save_state() and load_state()"},
    {" SafetensorsFile ", "use its write(path), and SafetensorsFile.read(path)"},
    {" Tape Inspector ", "make it anew in the other process"},
    {" Value ", "use numpy.array(value.numpy())"},
};

const char* advice_for(const std::string& kind) {
  for (const Advice& advice : kAdvice)
    if (advice.kinds.find(" " + kind + " ") != std::string_view::npos) return advice.text;
  return "keep its numbers instead";
}

}  // namespace

void bind_pickling_refusals(py::module_& module) {
  for (const auto& [key, member] : py::dict(module.attr("__dict__"))) {
    if (!PyType_Check(member.ptr()) || PyExceptionClass_Check(member.ptr())) continue;
    const auto owner = py::reinterpret_borrow<py::object>(member);
    if (py::dict(owner.attr("__dict__")).contains("__getstate__")) continue;
    const std::string whole = py::str(key), kind = whole.substr(0, whole.find("_float"));
    owner.attr("__reduce__") = py::cpp_function(
        [kind](const py::object&) -> py::object {
          throw py::type_error("[" + kind + "] cannot be pickled or copied: " + advice_for(kind));
        },
        py::name("__reduce__"), py::is_method(owner), "Raises TypeError, which names what to use instead.");
  }
}

}  // namespace fieldmark::python
