#pragma once
// Tapes, their values and parameter stores as Python objects.
#include <fieldmark/engine/dual.h>
#include <fieldmark/engine/params.h>
#include <fieldmark/engine/tape.h>

#include <algorithm>
#include <optional>
#include <string_view>

#include "held_arrays.h"

namespace fieldmark::python {

/// A parameter store. It rejects new parameters while a pass, an array or an optimiser refers to its memory.
template <class T>
struct StoreHandle {
  ParamStore<T> store;
  Leases leases;  // also counts changes of values by steps and files

  /// Returns the store for adding parameters.
  /// @param where  for error messages   @throws BufferError if its memory is in use
  ParamStore<T>& open(std::string_view where) {
    if (leases.count() > 0)
      throw py::buffer_error("[" + std::string(where) + "] " + std::to_string(leases.count()) +
                             " arrays, passes or optimisers refer to the parameters: add all of them first");
    return store;
  }
};

/// A tape, the memory that its pass reads, and a count of the arrays that show its memory.
template <class T>
struct TapeHandle {
  std::unique_ptr<Tape<T>> own;  // null if the tape belongs to another object
  std::uint64_t pass = 0;
  Leases views;

  TapeHandle() : own(std::make_unique<Tape<T>>()), tape_(own.get()) {}
  explicit TapeHandle(Tape<T>& others) : tape_(&others) {}
  /// Overload for a call that computes or checks the parameters of a store: layers then read `computed`.
  TapeHandle(Tape<T>& others, const ParamStore<T>& store, const Params<T>& computed)
      : tape_(&others), store_(&store), computed_(computed) {}
  /// @throws ValueError after end()
  Tape<T>& tape() const {
    if (!tape_) throw ValueError("[tape] it belongs to a call that has ended");
    return *tape_;
  }
  /// Returns the parameters of a store for this pass.
  Params<T> params(StoreHandle<T>& s) const { return store_ == &s.store ? *computed_ : Params<T>(s.store); }

  /// Returns an array of U for an op to read; call keep() once the op is recorded.
  /// @throws ValueError if this pass adds gradients to it, or it shows a value of this pass: array and pass
  /// would keep each other alive
  template <class U = T>
  py::array reads(const char* where, const py::object& given) const {
    py::array array = borrowed<U>(where, given);
    if (Leases::owner(array) == this)
      throw ValueError(std::string("[") + where +
                       "] shows a value of the same tape: pass x.copy(), or use engine.detach(value)");
    memory_.check_read(where, memory_of(array));
    return array;
  }
  /// Holds what the pass reads until it ends.
  void keep(const py::array& array) {
    memory_.add_read(memory_of(array));
    hold(array);
  }
  /// Overload for a leaf, whose gradient is added to another array.
  /// @throws ValueError if `grads` is an array that the pass reads
  void keep(const py::array& values, const py::array& grads) {
    memory_.check_leaf("leaf", memory_of(values), memory_of(grads));
    memory_.add_leaf(memory_of(values), memory_of(grads));
    hold(values);
    grads_.push_back(grads);
  }
  /// Returns f(), which records ops that read a parameter store and add to its gradients. If f throws, the
  /// store is as free as before.
  template <class F>
  auto reading(const std::shared_ptr<StoreHandle<T>>& store, F f) {
    const bool first = reads(store);
    try {
      return f();
    } catch (...) {
      if (first && !tape().observer()) forget_last_store();  // an observer shows what the failed op read
      throw;
    }
  }
  /// @throws ValueError if a step or a file has changed parameters since the pass read them
  void check_unchanged() const {
    for (const Watched& w : watched_)
      if (*w.changes != w.before)
        throw ValueError("[backward] the parameters have changed since this pass read them: record it again");
  }
  /// Ends the pass. @throws BufferError while arrays show its values
  void reset() {
    if (!own) throw ValueError("[reset] the tape of a call such as gradcheck() is not yours to reset");
    if (views.count() > 0)
      throw py::buffer_error(
          "[reset] " + std::to_string(views.count()) +
          " arrays show values of this pass: copy them with numpy.array(x), or delete them");
    tape().reset();
    forget();
  }
  /// Ends the pass of another object's tape, which may be gone afterwards.
  void end() {
    forget();
    tape_ = nullptr;
  }
  /// Invalidates the values of the pass and releases what it reads.
  void forget() {
    ++pass;
    held_.release();
    memory_.forget();
    grads_.clear();
    stores_.clear();
    watched_.clear();
  }

 private:
  // Records that the pass reads a store; false: it is recorded already.
  bool reads(const std::shared_ptr<StoreHandle<T>>& store) {
    for (const Read& r : stores_)
      if (r.store == store) return false;
    const auto values = store->store.values(), grads = store->store.grads();
    const Memory read{values.data(), values.size_bytes()}, added_to{grads.data(), grads.size_bytes()};
    memory_.check_leaf("parameters", read, added_to);
    memory_.add_leaf(read, added_to);
    stores_.push_back({store, store->leases.lend(store)});
    watch(store->leases.changes());
    return true;
  }
  void forget_last_store() {
    memory_.forget_last_leaf();
    stores_.pop_back();
    watched_.pop_back();
  }
  void watch(const std::shared_ptr<const std::uint64_t>& changes) {
    if (changes) watched_.push_back({changes, *changes});
  }
  void hold(const py::array& array) {
    watch(Leases::changes(array));
    held_.hold(array);
  }
  struct Read {
    std::shared_ptr<StoreHandle<T>> store;
    py::capsule lease;
  };
  // Memory that the pass reads, and the count of its changes when the pass read it.
  struct Watched {
    std::shared_ptr<const std::uint64_t> changes;
    std::uint64_t before;
  };
  Tape<T>* tape_;
  const ParamStore<T>* store_ = nullptr;
  std::optional<Params<T>> computed_;  // of store_
  HeldArrays held_;
  PassMemory memory_;
  std::vector<py::array> grads_;
  std::vector<Read> stores_;
  std::vector<Watched> watched_;
};

/// An optional array that an op reads.
template <class U>
struct Reading {
  py::object array = py::none();
  std::span<const U> elements = {};
};

/// A value of one pass; within jvp() and hvp() with a tangent.
template <class T>
struct Value {
  std::shared_ptr<TapeHandle<T>> tape;
  Dual<T> var;
  std::uint64_t pass;

  Value(std::shared_ptr<TapeHandle<T>> t, Dual<T> v) : tape(std::move(t)), var(v), pass(tape->pass) {}
  /// @throws ValueError if the tape has forgotten the pass
  Dual<T> dual() const {
    if (pass != tape->pass) throw ValueError("[value] it belongs to a pass that Tape.reset() has forgotten");
    return var;
  }
  /// Returns the value for an op without a tangent.
  /// @param op  for the error message   @throws TypeError if the value has one; @throws as dual()
  Var<T> get(const char* op) const {
    if (dual().has_tangent())
      throw py::type_error("[" + std::string(op) +
                           "] has no tangent, so that no jvp() or hvp() passes through it");
    return var.value();
  }
  /// Returns the value without its tangent. @throws as dual()
  Var<T> primal() const { return dual().value(); }
  /// Returns a value of the same pass, and holds the arrays that its op reads.
  template <class... U>
  Value with(Dual<T> v, const Reading<U>&... read) const {
    (keep(read.array), ...);
    return Value(tape, v);
  }

 private:
  void keep(const py::object& array) const {
    if (!array.is_none()) tape->keep(py::reinterpret_borrow<py::array>(array));
  }
};

/// Returns f of the values, as Vars or, if one has a tangent, as Duals.
template <class T, class F, class... V>
Dual<T> on(F f, const Value<T>& first, const V&... rest) {
  const bool tangent = (first.dual().has_tangent() || ... || rest.dual().has_tangent());
  if (tangent) return f(first.dual(), rest.dual()...);
  return f(first.primal(), rest.primal()...);
}

/// Whether an object is a value of either scalar type.
inline bool is_value(const py::handle& given) {
  return py::isinstance<Value<float>>(given) || py::isinstance<Value<double>>(given);
}

/// Returns an argument as a value.
/// @param where  "function: argument", for error messages   @throws TypeError if it is something else
template <class T>
const Value<T>& value_of(const std::string& where, const py::object& given) {
  if (py::isinstance<Value<T>>(given)) return given.cast<const Value<T>&>();
  throw py::type_error("[" + where + "] must be a value of " + dtype_name<T>() + ", got " + type_name(given) +
                       (py::isinstance<py::array>(given) ? ": pass it as tape.constant(x)" : ""));
}

/// Returns an argument as a tape.
/// @param where  "function", for error messages   @throws TypeError if it is something else
template <class T>
std::shared_ptr<TapeHandle<T>> tape_of(const std::string& where, const py::object& given) {
  if (!py::isinstance<TapeHandle<T>>(given))
    throw py::type_error("[" + where + "] tape must be Tape() of " + dtype_name<T>() + ", got " +
                         type_name(given));
  return given.cast<std::shared_ptr<TapeHandle<T>>>();
}

/// Documentation of an op, shown once for both scalar types.
template <class T>
const char* once(const char* text) {
  return std::is_same_v<T, float> ? text : "";
}

template <class T>
void bind_tape(py::module_& module, const std::string& suffix);
/// Binds stores, optimisers and files of their state.
template <class T>
void bind_parameters(py::module_& module, const std::string& suffix);
/// Binds layers that register their parameters in a store.
template <class T>
void bind_layers(py::module_& module, const std::string& suffix);
template <class T>
void bind_inspector(py::module_& module, const std::string& suffix);
/// @{
/// Bind ops on float or double values: on elements and axes; on images, rows and losses.
template <class T>
void bind_ops(py::module_& module);
template <class T>
void bind_network_ops(py::module_& module);
/// @}

}  // namespace fieldmark::python
