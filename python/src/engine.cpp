// The engine: everything for one scalar type, schedules, threads, and refusals of arguments.
#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/decay.h>
#include <fieldmark/engine/inspect.h>
#include <fieldmark/engine/ops/batch_norm.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/schedule.h>
#include <pybind11/stl.h>

#include <cmath>
#include <optional>

#include "number_argument.h"
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

void bind_reports(py::module_& module) {
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

Schedule schedule_from(double lr, std::optional<Index> steps, std::optional<double> seconds,
                       double half_after, double cooldown, double last) {
  if (steps.has_value() == seconds.has_value())
    throw ValueError(std::string("[Schedule] give steps or seconds, got ") + (steps ? "both" : "neither"));
  if (steps) require_within("Schedule", "steps", *steps, 1);
  return Schedule({.steps = steps.value_or(0),
                   .seconds = seconds.value_or(60),
                   .lr = lr,
                   .half_after = half_after,
                   .cooldown = cooldown,
                   .last = last});
}

void bind_schedules(py::module_& module) {
  module.def("cosine_decay", &cosine_decay, "n"_a, "steps"_a, "last"_a = 0.0,
             "Half a cosine from 1 at step 0 to `last` at step `steps` and after.");
  module.def("step_decay", &step_decay, "n"_a, "every"_a, "factor"_a = 0.1, "factor^floor(n / every).");
  module.def("exponential_decay", &exponential_decay, "n"_a, "factor"_a, "factor^n.");
  module.def("warm_up", &warm_up, "n"_a, "steps"_a, "min(1, (n + 1) / steps); always 1 if steps is 0.");
  py::class_<Schedule>(module, "Schedule",
                       "Step sizes of a run whose length is given in steps or in seconds.")
      .def(py::init(&schedule_from), "lr"_a = 2e-2, "steps"_a = py::none(), "seconds"_a = py::none(),
           "half_after"_a = 8000.0, "cooldown"_a = 0.3, "last"_a = 0.03,
           "lr / (1 + n / half_after) last^max(0, (n - n_c) / (N - n_c)) at step n of N, n_c = floor((1 - "
           "cooldown) N).\n\n"
           "Give `steps`, which is N, or `seconds`: the run then measures its steps and fixes N when the "
           "cooldown\n"
           "must begin. ValueError if both or neither is given, or a number is out of range.")
      .def(
          "observe",
          [](Schedule& s, Index n, double seconds) {
            require_within("Schedule.observe", "n", n, 0);
            if (!(seconds >= 0) || std::isinf(seconds))
              throw ValueError("[Schedule.observe] seconds must be at least 0 and finite, got " +
                               number_text(seconds));
            s.observe(n, seconds);
          },
          "n"_a, "seconds"_a,
          "Records the time before step n, in seconds since the start, from which a timed run plans N.")
      .def(
          "lr",
          [](const Schedule& s, Index n) {
            require_within("Schedule.lr", "n", n, 0);
            return s.lr(n);
          },
          "n"_a, "The step size of step n, counted from 0.")
      .def(
          "done",
          [](const Schedule& s, Index n) {
            require_within("Schedule.done", "n", n, 0);
            return s.done(n);
          },
          "n"_a, "Whether the run ends before step n.")
      .def_property_readonly("total", &Schedule::total, "N, or 0 until a timed run has fixed it.")
      .def_property_readonly("replanned", &Schedule::replanned,
                             "Whether N was fixed anew, so that earlier steps had the step sizes of another "
                             "N.")
      .def(
          "resume",
          [](Schedule& s, Index total, Flag replanned) {
            require_within("Schedule.resume", "total", total, 0);
            s.resume(total, replanned);
          },
          "total"_a, "replanned"_a, "Goes on with `total` and `replanned` of an earlier process.");
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
  bind_schedules(module);
  bind_adam_group(module);
  bind_engine_of<float>(module, "float32");
  bind_engine_of<double>(module, "float64");
  bind_gradients(module);
  module.def("threads", &threads, "The number of threads that work is shared among.");
  module.def(
      "set_threads",
      [](Index count) {
        require_within("set_threads", "count", count, 1, kMostThreads);
        set_threads(static_cast<int>(count));
      },
      "count"_a, "Sets the number of threads, 1 to 1024. ValueError otherwise.");
}

}  // namespace fieldmark::python
