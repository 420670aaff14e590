#pragma once
// The arrays that a pass reads where they lie.
#include <cstddef>
#include <vector>

#include "arrays.h"

namespace fieldmark::python {

/// Arrays that a pass reads, until release(): they stay alive and, with the arrays that they show a part of,
/// read-only. A write between forward and backward would otherwise give wrong gradients in silence. Views
/// made before can still write.
class HeldArrays {
 public:
  HeldArrays() = default;
  HeldArrays(const HeldArrays&) = delete;
  HeldArrays& operator=(const HeldArrays&) = delete;
  ~HeldArrays() { release(); }
  void hold(const py::array& array);
  void release();

 private:
  std::vector<py::object> arrays_;
};

/// Where an array lies.
struct Memory {
  const void* begin;
  std::size_t bytes;
};
inline Memory memory_of(const py::array& array) {
  return {array.data(), static_cast<std::size_t>(array.nbytes())};
}

/// The memory of a pass that is not the tape's own: what it reads, and gradients, which backwards change. No
/// array is both.
class PassMemory {
 public:
  /// @param where  "function: argument", for errors   @throws ValueError if it is a gradient
  void check_read(const char* where, const Memory& values) const;
  /// @throws ValueError if the values are a gradient, or the gradient is read
  void check_leaf(const char* where, const Memory& values, const Memory& grads) const;
  void add_read(const Memory& values) { read_.push_back(values); }
  void add_leaf(const Memory& values, const Memory& grads) {
    read_.push_back(values);
    added_to_.push_back(grads);
  }
  void forget();

 private:
  std::vector<Memory> read_, added_to_;
};

}  // namespace fieldmark::python
