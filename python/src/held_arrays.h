#pragma once
// The arrays that a pass reads without copying.
#include <cstddef>
#include <vector>

#include "arrays.h"

namespace fieldmark::python {

/// Arrays that a pass reads, until release(). They stay alive and read-only, as do the arrays that they are
/// views of: a write between forward and backward would silently give wrong gradients. Views made before can
/// still write.
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

/// The memory of an array.
struct Memory {
  const void* begin;
  std::size_t bytes;
};
inline Memory memory_of(const py::array& array) {
  return {array.data(), static_cast<std::size_t>(array.nbytes())};
}

/// External memory of a pass: arrays that it reads, and gradients that backwards change. No array is both.
class PassMemory {
 public:
  /// @param where  "function: argument", for error messages   @throws ValueError if it is a gradient
  void check_read(const char* where, const Memory& values) const;
  /// @throws ValueError if the values are a gradient, or the pass reads the gradient
  void check_leaf(const char* where, const Memory& values, const Memory& grads) const;
  void add_read(const Memory& values) { read_.push_back(values); }
  void add_leaf(const Memory& values, const Memory& grads) {
    read_.push_back(values);
    added_to_.push_back(grads);
  }
  /// Undoes the last add_leaf(), if no other memory was added since.
  void forget_last_leaf() {
    read_.pop_back();
    added_to_.pop_back();
  }
  void forget();

 private:
  std::vector<Memory> read_, added_to_;
};

}  // namespace fieldmark::python
