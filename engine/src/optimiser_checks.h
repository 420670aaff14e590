#pragma once
// Checks shared by the optimisers. Private.
#include <fieldmark/engine/params.h>

#include <algorithm>
#include <string>

namespace fieldmark::detail {

/// @throws ShapeError unless an array has as many elements as the optimiser
inline void check_step_size(const char* optimiser, const char* name, std::size_t got, std::size_t want) {
  if (got != want)
    throw ShapeError("[" + std::string(optimiser) + "::step] " + name + " must have " + std::to_string(want) +
                     " elements, as the optimiser, got " + std::to_string(got));
}

/// @throws ValueError unless a pattern matches the name of a trained parameter
template <class T>
void check_pattern(const char* function, const ParamStore<T>& store, const std::string& pattern) {
  if (std::ranges::none_of(store.entries(), [&](const auto& e) {
        return is_trained(e.role) && name_matches(pattern, e.name);
      }))
    throw ValueError("[" + std::string(function) + "] no trained parameter of the store has a name like '" +
                     pattern + "'");
}

}  // namespace fieldmark::detail
