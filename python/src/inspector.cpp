// The tape inspector: its graph, its costs, the first NaN.
#include <fieldmark/engine/inspect.h>
#include <pybind11/stl.h>

#include <optional>

#include "number_argument.h"
#include "stats_dict.h"
#include "tape_value.h"

namespace fieldmark::python {
namespace {

using namespace py::literals;

// An inspector and the tape that it watches until closed.
template <class T>
struct InspectorHandle {
  std::shared_ptr<TapeHandle<T>> tape;
  std::optional<TapeInspector<T>> inspector;

  bool statistics;

  InspectorHandle(std::shared_ptr<TapeHandle<T>> t, Flag stop_at_nonfinite, Flag with_statistics)
      : tape(std::move(t)), statistics(with_statistics) {
    if (!tape->own)
      throw ValueError("[Inspector] the tape of a call such as gradcheck() is not yours to inspect");
    inspector.emplace(tape->tape(),
                      InspectOptions{.stop_at_nonfinite = stop_at_nonfinite, .statistics = with_statistics});
  }
  const TapeInspector<T>& open() const {
    if (!inspector) throw ValueError("[Inspector] it is closed");
    return *inspector;
  }
  // As open(), for what only an inspector with statistics gathers.
  const TapeInspector<T>& measuring(const char* method) const {
    if (!statistics)
      throw ValueError("[Inspector." + std::string(method) + "] needs Inspector(tape, statistics=True)");
    return open();
  }
};

}  // namespace

template <class T>
void bind_inspector(py::module_& module, const std::string& suffix) {
  using Handle = InspectorHandle<T>;
  py::class_<Handle>(module, ("Inspector_" + suffix).c_str(),
                     "Looks at what a tape records, until it is closed.")
      .def(py::init<std::shared_ptr<TapeHandle<T>>, Flag, Flag>(), py::arg("tape").none(false),
           "stop_at_nonfinite"_a, "statistics"_a = false)
      .def(
          "text", [](const Handle& h) { return h.open().text(); },
          "The graph of this pass, one line for each value.")
      .def(
          "dot", [](const Handle& h) { return h.open().dot(); },
          "The graph of this pass in the language of Graphviz.")
      .def(
          "costs", [](const Handle& h) { return h.open().costs(); },
          "Time and memory by op since the inspector was made; the most expensive first.")
      .def(
          "cost_table", [](const Handle& h) { return h.open().cost_table(); }, "costs() as a table.")
      .def(
          "gradient_stats",
          [](const Handle& h) { return as_dict(h.measuring("gradient_stats").gradient_stats()); },
          "Statistics of the gradient of each named value and parameter that received one, over all passes: "
          "count,\nzeros, nonfinite, and mean, rms and largest magnitude of what is finite. ValueError "
          "without `statistics`.")
      .def(
          "value_stats", [](const Handle& h) { return as_dict(h.measuring("value_stats").value_stats()); },
          "The same of each named value at the time it was named.")
      .def(
          "close", [](Handle& h) { h.inspector.reset(); }, "Stops watching the tape.")
      .def("__enter__", [](py::object self) { return self; })
      .def("__exit__", [](Handle& h, const py::args&) { h.inspector.reset(); });
}
template void bind_inspector<float>(py::module_&, const std::string&);
template void bind_inspector<double>(py::module_&, const std::string&);

}  // namespace fieldmark::python
