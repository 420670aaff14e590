#include <fieldmark/core/error.h>
#include <fieldmark/engine/state_file.h>

#include "state_arrays.h"

namespace fieldmark {
namespace {

// No optimiser: the parameters alone.
struct Nothing {};

template <class Store, class Entry, class F>
void visit_state(Store& store, const Nothing&, const Entry& e, const std::string& prefix, F visit) {
  visit(prefix + e.name, detail::part_of(store.values(), e), e.shape);
}
template <class Store, class A, class Entry, class F>
requires requires(A& a) { a.mean_square(); }
void visit_state(Store& store, A& adam, const Entry& e, const std::string& prefix, F visit) {
  detail::visit_adam(store, adam, e, prefix, visit);
}
template <class Store, HasVelocity S, class Entry, class F>
void visit_state(Store& store, S& optimiser, const Entry& e, const std::string& prefix, F visit) {
  detail::visit_velocity(store, optimiser, e, prefix, visit);
}

Index size_of_state(const auto& optimiser) {
  if constexpr (HasVelocity<decltype(optimiser)>)
    return std::ssize(optimiser.velocity());
  else
    return std::ssize(optimiser.mean());
}

template <class T, class O>
void check_optimiser(const char* function, const ParamStore<T>& store, const O& optimiser) {
  if constexpr (!std::is_same_v<O, Nothing>)
    if (const Index n = size_of_state(optimiser); n != store.size())
      throw ShapeError(std::string("[") + function + "] optimiser must be for the " +
                       std::to_string(store.size()) + " elements of the store, got one for " +
                       std::to_string(n));
}

// Returns the parameters of a module, named as it names them; all of the store for an empty name.
template <class T>
auto entries_of_module(const char* function, const ParamStore<T>& store, std::string_view module) {
  std::vector<typename ParamStore<T>::Entry> entries(store.entries().begin(), store.entries().end());
  if (module.empty()) return entries;
  const std::string begin = std::string(module) + "/";
  std::erase_if(entries, [&](const auto& e) { return !e.name.starts_with(begin); });
  if (entries.empty())
    throw ValueError("[" + std::string(function) + "] the store has no parameter of the module '" +
                     std::string(module) + "'");
  for (auto& e : entries) e.name.erase(0, begin.size());
  return entries;
}

template <class T, class O>
void save(SafetensorsFile& file, const std::string& prefix, const ParamStore<T>& store, const O& optimiser,
          std::string_view module) {
  check_optimiser("save_state", store, optimiser);
  for (const auto& e : entries_of_module("save_state", store, module))
    visit_state(store, optimiser, e, prefix,
                [&](const std::string& name, std::span<const T> elements, const Shape& shape) {
                  file.add(name, shape, elements);
                });
}

// Checks everything before changing anything.
template <class T, class O>
void load(const SafetensorsFile& file, const std::string& prefix, ParamStore<T>& store, O& optimiser,
          std::string_view module) {
  check_optimiser("load_state", store, optimiser);
  const auto entries = entries_of_module("load_state", store, module);
  const auto each = [&](auto visit) {
    for (const auto& e : entries) visit_state(store, optimiser, e, prefix, visit);
  };
  each([&](const std::string& name, std::span<T>, const Shape& shape) {
    const auto& e = file.at(name);
    if (e.shape != shape || e.dtype != detail::dtype_of<T>())
      throw IoError(file.path + ": tensor '" + name + "': expected shape " + shape.str() + " of " +
                    detail::dtype_of<T>() + ", found shape " + e.shape.str() + " of " + e.dtype);
  });
  each([&](const std::string& name, std::span<T> elements, const Shape&) {
    detail::read_array(file, name, elements);
  });
}

std::string steps_name(std::string_view prefix) { return std::string(prefix) + "adam/steps"; }

}  // namespace

template <class T>
void save_state(SafetensorsFile& file, std::string_view prefix, const ParamStore<T>& store,
                std::string_view module) {
  save(file, std::string(prefix), store, Nothing{}, module);
}

template <class T>
void save_state(SafetensorsFile& file, std::string_view prefix, const ParamStore<T>& store,
                const Adam<T>& optimiser, std::string_view module) {
  save(file, std::string(prefix), store, optimiser, module);
  if (!module.empty()) return;
  const std::int64_t steps = optimiser.steps();
  file.add(steps_name(prefix), {1}, std::span(&steps, 1));
}

template <class T, template <class> class Optimiser>
requires HasVelocity<Optimiser<T>>
void save_state(SafetensorsFile& file, std::string_view prefix, const ParamStore<T>& store,
                const Optimiser<T>& optimiser, std::string_view module) {
  save(file, std::string(prefix), store, optimiser, module);
}

template <class T>
void load_state(const SafetensorsFile& file, std::string_view prefix, ParamStore<T>& store,
                std::string_view module) {
  Nothing nothing;
  load(file, std::string(prefix), store, nothing, module);
}

template <class T>
void load_state(const SafetensorsFile& file, std::string_view prefix, ParamStore<T>& store,
                Adam<T>& optimiser, std::string_view module) {
  if (!module.empty()) return load(file, std::string(prefix), store, optimiser, module);
  std::int64_t steps = 0;
  detail::read_array(file, steps_name(prefix), std::span(&steps, 1));
  if (steps < 0)
    throw IoError(file.path + ": tensor '" + steps_name(prefix) + "': expected 0 steps or more, found " +
                  std::to_string(steps));
  load(file, std::string(prefix), store, optimiser, module);
  optimiser.set_steps(steps);
}

template <class T, template <class> class Optimiser>
requires HasVelocity<Optimiser<T>>
void load_state(const SafetensorsFile& file, std::string_view prefix, ParamStore<T>& store,
                Optimiser<T>& optimiser, std::string_view module) {
  load(file, std::string(prefix), store, optimiser, module);
}

#define FIELDMARK_STATE(T)                                                                              \
  template void save_state(SafetensorsFile&, std::string_view, const ParamStore<T>&, std::string_view); \
  template void save_state(SafetensorsFile&, std::string_view, const ParamStore<T>&, const Adam<T>&,    \
                           std::string_view);                                                           \
  template void save_state(SafetensorsFile&, std::string_view, const ParamStore<T>&, const Sgd<T>&,     \
                           std::string_view);                                                           \
  template void save_state(SafetensorsFile&, std::string_view, const ParamStore<T>&, const Muon<T>&,    \
                           std::string_view);                                                           \
  template void load_state(const SafetensorsFile&, std::string_view, ParamStore<T>&, std::string_view); \
  template void load_state(const SafetensorsFile&, std::string_view, ParamStore<T>&, Adam<T>&,          \
                           std::string_view);                                                           \
  template void load_state(const SafetensorsFile&, std::string_view, ParamStore<T>&, Sgd<T>&,           \
                           std::string_view);                                                           \
  template void load_state(const SafetensorsFile&, std::string_view, ParamStore<T>&, Muon<T>&,          \
                           std::string_view);
FIELDMARK_STATE(float)
FIELDMARK_STATE(double)
#undef FIELDMARK_STATE

}  // namespace fieldmark
