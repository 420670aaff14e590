#pragma once
// The arrays that hold the state of parameters in files. Private.
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/safetensors.h>

#include <cstring>
#include <string>
#include <type_traits>

namespace fieldmark::detail {

template <class T>
constexpr const char* dtype_of() {
  return std::is_same_v<T, float> ? "F32" : std::is_same_v<T, double> ? "F64" : "I64";
}

// Copies an array of a file to `to`, whose type and number of elements must match.
template <class T>
void read_array(const SafetensorsFile& file, const std::string& name, std::span<T> to) {
  const SafetensorsFile::Entry& e = file.at(name);
  if (e.dtype != dtype_of<T>() || e.data.size() != to.size_bytes())
    throw IoError(file.path + ": tensor '" + name + "': expected " + std::to_string(to.size()) +
                  " elements of " + dtype_of<T>() + ", found shape " + e.shape.str() + " of " + e.dtype);
  std::memcpy(to.data(), e.data.data(), e.data.size());
}

// Returns the elements of one parameter in a flat array.
template <class T, class Entry>
std::span<T> part_of(std::span<T> all, const Entry& e) {
  return all.subspan(at(e.offset), at(e.shape.size()));
}

// Calls visit(name, elements, shape) for one parameter and its moments.
template <class Store, class A, class Entry, class F>
void visit_adam(Store& store, A& adam, const Entry& e, const std::string& prefix, F visit) {
  const std::string name = prefix + e.name;
  visit(name, part_of(store.values(), e), e.shape);
  visit(name + ".mean", part_of(adam.mean(), e), e.shape);
  visit(name + ".mean_square", part_of(adam.mean_square(), e), e.shape);
}

// Calls visit(name, elements, shape) for one parameter and its velocity.
template <class Store, class O, class Entry, class F>
void visit_velocity(Store& store, O& optimiser, const Entry& e, const std::string& prefix, F visit) {
  const std::string name = prefix + e.name;
  visit(name, part_of(store.values(), e), e.shape);
  visit(name + ".velocity", part_of(optimiser.velocity(), e), e.shape);
}

}  // namespace fieldmark::detail
