#pragma once
// The tape and its values as Python holds them.
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/params.h>
#include <fieldmark/engine/sgd.h>
#include <fieldmark/engine/tape.h>

#include "arrays.h"

namespace fieldmark::python {

/// A tape, the arrays that its pass reads, and a count of the arrays that show its memory.
template <class T>
struct TapeHandle {
  std::unique_ptr<Tape<T>> own;  // null: the tape is another's
  Tape<T>& tape;
  std::uint64_t pass = 0;
  std::vector<py::object> inputs;
  Leases views;

  TapeHandle() : own(std::make_unique<Tape<T>>()), tape(*own) {}
  explicit TapeHandle(Tape<T>& others) : tape(others) {}

  void reset() {
    if (!own) throw py::value_error("[reset] the tape of a gradient check is not yours to reset");
    if (views.count() > 0)
      throw py::buffer_error(
          "[reset] " + std::to_string(views.count()) +
          " arrays show values of this pass: copy them with numpy.array(x), or delete them");
    tape.reset();
    inputs.clear();
    ++pass;
  }
};

/// A value of one pass.
template <class T>
struct Value {
  std::shared_ptr<TapeHandle<T>> tape;
  Var<T> var;
  std::uint64_t pass;

  Value(std::shared_ptr<TapeHandle<T>> t, Var<T> v) : tape(std::move(t)), var(v), pass(tape->pass) {}
  /// @throws ValueError if the tape has forgotten the pass
  Var<T> get() const {
    if (pass != tape->pass)
      throw py::value_error("[value] it belongs to a pass that Tape.reset() has forgotten");
    return var;
  }
  Value with(Var<T> v) const { return Value(tape, v); }
};

/// A store of parameters; while a pass or an array refers to its memory, it takes no more of them.
template <class T>
struct StoreHandle {
  ParamStore<T> store;
  Leases leases;

  ParamId add(const std::string& name, const py::object& given) {
    if (leases.count() > 0)
      throw py::buffer_error("[Parameters.add] " + std::to_string(leases.count()) +
                             " arrays or values of a pass refer to the parameters: add all of them first");
    const py::array array = borrowed<T>("Parameters.add: values", given);
    const ParamId id = store.add(name, shape_of(array));
    std::ranges::copy(elements<T>(array), store.values(id).begin());
    return id;
  }
};

}  // namespace fieldmark::python
