// Keeps arrays read-only during passes, and checks that values and gradients do not overlap.
#include "held_arrays.h"

#include <algorithm>
#include <cstdint>
#include <unordered_map>

namespace fieldmark::python {
namespace {

struct Hold {
  int count = 0;           // number of passes that read the array
  bool writeable = false;  // before the first hold
};

// Shared by all tapes, since several may read one array. It outlives the module's objects, whose order of
// destruction is up to Python.
std::unordered_map<PyObject*, Hold>& holds() {
  static auto* all = new std::unordered_map<PyObject*, Hold>;
  return *all;
}

constexpr int kWriteable = py::detail::npy_api::NPY_ARRAY_WRITEABLE_;

void lock(const py::object& array) {
  Hold& hold = holds()[array.ptr()];
  int& flags = py::detail::array_proxy(array.ptr())->flags;
  if (hold.count++ == 0) hold.writeable = (flags & kWriteable) != 0;
  flags &= ~kWriteable;
}

void unlock(const py::object& array) {
  const auto hold = holds().find(array.ptr());
  if (--hold->second.count > 0) return;
  if (hold->second.writeable) py::detail::array_proxy(array.ptr())->flags |= kWriteable;
  holds().erase(hold);
}

bool meet(const Memory& a, const Memory& b) {
  const auto begin = [](const Memory& m) { return reinterpret_cast<std::uintptr_t>(m.begin); };
  return a.bytes > 0 && b.bytes > 0 && begin(a) < begin(b) + b.bytes && begin(b) < begin(a) + a.bytes;
}

bool meets(const std::vector<Memory>& all, const Memory& one) {
  return std::ranges::any_of(all, [&](const Memory& m) { return meet(m, one); });
}

}  // namespace

void HeldArrays::hold(const py::array& array) {
  for (py::object a = array; a && py::isinstance<py::array>(a);
       a = py::reinterpret_borrow<py::array>(a).base()) {
    arrays_.push_back(a);
    lock(a);
  }
}

void HeldArrays::release() {
  for (const py::object& array : arrays_) unlock(array);
  arrays_.clear();
}

void PassMemory::check_read(const char* where, const Memory& values) const {
  if (meets(added_to_, values))
    throw ValueError(std::string("[") + where +
                     "] shares memory with a gradient of this pass, which backward changes: pass x.copy()");
}

void PassMemory::check_leaf(const char* where, const Memory& values, const Memory& grads) const {
  check_read(where, values);
  if (meets(read_, grads) || meet(values, grads))
    throw ValueError(std::string("[") + where +
                     "] grad shares memory with an array that this pass reads, which backward would change: "
                     "pass one of its own, such as numpy.zeros_like(x)");
}

void PassMemory::forget() {
  read_.clear();
  added_to_.clear();
}

}  // namespace fieldmark::python
