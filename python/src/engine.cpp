// The engine: everything for one scalar type, gradient checks, schedules, state files.
#include <fieldmark/engine/decay.h>
#include <fieldmark/engine/gradcheck.h>
#include <fieldmark/engine/inspect.h>
#include <fieldmark/engine/ops/batch_norm.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/safetensors.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cstdio>

#include "tape_value.h"

namespace fieldmark::python {
namespace {

// An argument of any type. Unlike py::object, it does not match before all overloads were tried with
// conversions.
struct Anything {
  py::object given;
};

}  // namespace
}  // namespace fieldmark::python

namespace pybind11::detail {

template <>
struct type_caster<fieldmark::python::Anything> {
  PYBIND11_TYPE_CASTER(fieldmark::python::Anything, const_name("object"));
  bool load(handle given, bool convert) {
    value.given = reinterpret_borrow<object>(given);
    return convert;
  }
};

}  // namespace pybind11::detail

namespace fieldmark::python {
namespace {

using namespace py::literals;

constexpr Index kMostThreads = 1024;

template <class T>
void bind_engine_of(py::module_& module, const std::string& suffix) {
  bind_tape<T>(module, suffix);
  bind_ops<T>(module);
  bind_network_ops<T>(module);
  bind_parameters<T>(module, suffix);
  bind_layers<T>(module, suffix);
  bind_inspector<T>(module, suffix);
}

// All arguments in order.
py::list listed(const Anything& first, const py::args& others) {
  py::list all;
  if (!first.given.is(py::ellipsis())) all.append(first.given);
  for (const py::handle other : others) all.append(other);
  return all;
}

// Adds a last overload to each function, which says what argument does not fit.
void bind_function_refusals(py::module_& module) {
  for (const auto& [name, function] : py::dict(module.attr("__dict__"))) {
    if (!PyCFunction_Check(function.ptr())) continue;
    const std::string op = py::str(name);
    module.def(
        op.c_str(),
        [op](const Anything& first, const py::args& others, const py::kwargs& named) {
          py::module_::import("fieldmark._refusal").attr("refuse")(op, listed(first, others), named);
        },
        "_argument"_a = py::ellipsis(), "Raises TypeError for other arguments.");
  }
}

// Adds such an overload to every method and constructor of a class, under the class's name without its type.
void bind_method_refusals(const py::object& owner) {
  const std::string whole = py::str(owner.attr("__name__")), kind = whole.substr(0, whole.find("_float"));
  const auto refuse = [whole, kind](const std::string& name, const py::object& given,
                                    const py::kwargs& named) {
    const bool special = name == "__init__" || name == "__call__";
    py::module_::import("fieldmark._refusal")
        .attr("refuse_method")(special ? kind : kind + "." + name, whole, name, given, named);
  };
  constexpr const char* kText = "Raises TypeError for other arguments.";
  for (const auto& [key, method] : py::dict(owner.attr("__dict__"))) {
    const std::string name = py::str(key);
    if (Py_TYPE(method.ptr()) == &PyStaticMethod_Type)
      owner.attr(name.c_str()) = py::staticmethod(py::cpp_function(
          [refuse, name](const Anything& first, const py::args& others, const py::kwargs& named) {
            refuse(name, listed(first, others), named);
          },
          py::name(name.c_str()), py::scope(owner), py::sibling(owner.attr(name.c_str())),
          "_argument"_a = py::ellipsis(), kText));
    if (!PyInstanceMethod_Check(method.ptr())) continue;
    if (name == "__init__")
      owner.attr("__init__") = py::cpp_function(
          [refuse](py::detail::value_and_holder&, const Anything& first, const py::args& others,
                   const py::kwargs& named) { refuse("__init__", listed(first, others), named); },
          py::name("__init__"), py::is_method(owner), py::sibling(owner.attr("__init__")),
          "_argument"_a = py::ellipsis(), py::detail::is_new_style_constructor(), kText);
    else if (!name.starts_with("__") || name == "__call__")
      owner.attr(name.c_str()) = py::cpp_function(
          [refuse, name](const py::object&, const Anything& first, const py::args& others,
                         const py::kwargs& named) { refuse(name, listed(first, others), named); },
          py::name(name.c_str()), py::is_method(owner), py::sibling(owner.attr(name.c_str())),
          "_argument"_a = py::ellipsis(), kText);
  }
}

// The inputs as values of gradcheck()'s own tape, which forgets them when the check ends.
class CheckedFunction {
 public:
  explicit CheckedFunction(py::function f) : f_(std::move(f)) {}
  ~CheckedFunction() { forget(); }
  CheckedFunction(const CheckedFunction&) = delete;
  CheckedFunction& operator=(const CheckedFunction&) = delete;
  Var<double> operator()(Tape<double>& tape, std::span<const Var<double>> xs) {
    forget();                                              // the checker has reset the tape
    handle_ = std::make_shared<TapeHandle<double>>(tape);  // backward reads what the handle keeps
    py::list values;
    for (const Var<double>& x : xs) values.append(Value<double>(handle_, x));
    const py::object y = f_(*values);
    if (!py::isinstance<Value<double>>(y))
      throw py::type_error("[gradcheck] f must return a value of float64, got " + type_name(y));
    return y.cast<const Value<double>&>().get();
  }

 private:
  void forget() {
    if (handle_) handle_->forget();
  }
  py::function f_;
  std::shared_ptr<TapeHandle<double>> handle_;
};

GradcheckReport check_gradients(const py::function& f, const std::vector<py::object>& inputs, double rtol) {
  if (inputs.empty()) throw ValueError("[gradcheck] inputs must not be empty");
  if (!(rtol > 0 && rtol < 1))
    throw ValueError("[gradcheck] rtol must be above 0 and below 1, got " + std::to_string(rtol));
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

void bind_reports(py::module_& module) {
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
  py::class_<OpCost>(module, "OpCost", "Time and memory of all calls of an op.")
      .def_readonly("op", &OpCost::op, "Name of the op.")
      .def_readonly("calls", &OpCost::calls, "Number of calls.")
      .def_readonly("forward_seconds", &OpCost::forward_seconds, "Seconds of all forwards.")
      .def_readonly("backward_seconds", &OpCost::backward_seconds, "Seconds of all backwards.")
      .def_readonly("forward_bytes", &OpCost::forward_bytes, "Bytes that the forwards took from the tape.")
      .def_readonly("backward_bytes", &OpCost::backward_bytes,
                    "Bytes that the backwards took from the tape.");
  py::class_<BatchStatistics>(module, "BatchStatistics", "Statistics of a batch, one value for each channel.")
      .def(py::init<>())
      .def_property_readonly(
          "mean", [](const BatchStatistics& s) { return py::array_t<double>(py::cast(s.mean)); },
          "Over images, height and width.")
      .def_property_readonly(
          "variance", [](const BatchStatistics& s) { return py::array_t<double>(py::cast(s.variance)); },
          "Divided by the count.");
}

void bind_files(py::module_& module) {
  py::class_<SafetensorsFile>(module, "SafetensorsFile", "Named arrays of a safetensors file.")
      .def(py::init<>())
      .def_static("read", &SafetensorsFile::read, "path"_a, "Reads and checks a whole file.")
      .def(
          "write", [](const SafetensorsFile& f, const std::filesystem::path& path) { f.write(path); },
          "path"_a, "Writes the file whole or not at all.")
      .def(
          "names",
          [](const SafetensorsFile& f) {
            std::vector<std::string> names;
            for (const auto& e : f.tensors) names.push_back(e.name);
            return names;
          },
          "Names of the arrays, in the order of the file.");
}

void bind_decays(py::module_& module) {
  module.def("cosine_decay", &cosine_decay, "n"_a, "steps"_a, "last"_a = 0.0,
             "Half a cosine from 1 at step 0 to `last` at step `steps` and after.");
  module.def("step_decay", &step_decay, "n"_a, "every"_a, "factor"_a = 0.1, "factor^floor(n / every).");
  module.def("exponential_decay", &exponential_decay, "n"_a, "factor"_a, "factor^n.");
  module.def("warm_up", &warm_up, "n"_a, "steps"_a, "min(1, (n + 1) / steps); always 1 if steps is 0.");
}

}  // namespace

void bind_refusals(py::module_& module) {
  bind_function_refusals(module);
  for (const auto& [name, member] : py::dict(module.attr("__dict__")))
    if (PyType_Check(member.ptr()) && !PyExceptionClass_Check(member.ptr()))
      bind_method_refusals(py::reinterpret_borrow<py::object>(member));
}

void bind_engine(py::module_& module) {
  bind_reports(module);
  bind_files(module);
  bind_decays(module);
  bind_engine_of<float>(module, "float32");
  bind_engine_of<double>(module, "float64");
  module.def("gradcheck", &check_gradients, "f"_a, "inputs"_a, "rtol"_a = 1e-7,
             "Compares gradients with finite differences, in float64. ValueError unless 0 < rtol < 1.");
  module.def("threads", &threads, "The number of threads that work is shared among.");
  module.def(
      "set_threads",
      [](Index count) {
        if (count < 1 || count > kMostThreads)
          throw ValueError("[set_threads] count must be from 1 to " + std::to_string(kMostThreads) +
                           ", got " + std::to_string(count));
        set_threads(static_cast<int>(count));
      },
      "count"_a, "Sets the number of threads, 1 to 1024. ValueError otherwise.");
}

}  // namespace fieldmark::python
