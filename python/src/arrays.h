#pragma once
// Zero-copy access to numpy arrays for the engine.
#include <fieldmark/core/error.h>
#include <fieldmark/engine/shape.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace fieldmark::python {

namespace py = pybind11;

template <class T>
const char* dtype_name() {
  return std::is_same_v<T, float> ? "float32" : std::is_same_v<T, double> ? "float64" : "int32";
}

/// Returns the name of an object's type, for error messages.
inline std::string type_name(const py::handle& object) {
  return py::str(py::type::of(object).attr("__name__")).cast<std::string>();
}

/// Whether an object is a number of Python or numpy.
inline bool is_number(const py::handle& object) {
  return PyFloat_Check(object.ptr()) || PyLong_Check(object.ptr()) ||
         py::isinstance(object, py::module_::import("numpy").attr("number"));
}

/// Borrows a numpy array of T in row-major order without copying its elements.
/// @param where  "function: argument", for error messages
/// @throws TypeError for another element type, or a mask   @throws ValueError for another layout
template <class T>
py::array borrowed(const std::string& where, const py::object& object) {
  const std::string wanted = dtype_name<T>();
  if (!py::isinstance<py::array>(object))
    throw py::type_error("[" + where + "] must be a numpy array of " + wanted + ", got " + type_name(object) +
                         (is_number(object) ? ": pass numpy.full((), x, '" + wanted + "')" : ""));
  const auto array = py::reinterpret_borrow<py::array>(object);
  if (py::hasattr(object, "mask"))  // some elements of a masked array do not count
    throw py::type_error("[" + where + "] must not be masked: pass x.filled(value)");
  if (!array.dtype().is(py::dtype::of<T>()) && !array.dtype().equal(py::dtype::of<T>()))
    throw py::type_error("[" + where + "] must be of " + wanted + ", got " +
                         py::str(array.dtype()).cast<std::string>() + ": convert it with x.astype('" +
                         wanted + "')");
  if (!(array.flags() & py::array::c_style))
    throw ValueError("[" + where +
                     "] must be contiguous in row-major order: pass numpy.ascontiguousarray(x)");
  if (!(array.flags() & py::detail::npy_api::NPY_ARRAY_ALIGNED_))
    throw ValueError("[" + where + "] must be aligned to the " + std::to_string(sizeof(T)) +
                     " bytes of its elements: pass x.copy()");
  return array;
}

inline Shape shape_of(const py::array& array) {
  std::vector<Index> extents(array.shape(), array.shape() + array.ndim());
  return Shape(std::span<const Index>(extents));
}

inline std::vector<py::ssize_t> extents_of(const Shape& shape) {
  std::vector<py::ssize_t> extents;
  for (int k = 0; k < shape.rank(); ++k) extents.push_back(shape[k]);
  return extents;
}

template <class T>
std::span<const T> elements(const py::array& array) {
  return {static_cast<const T*>(array.data()), static_cast<std::size_t>(array.size())};
}

/// Counts the users of memory that must not move; each lease is a Python object.
class Leases {
 public:
  /// Keeps `owner` alive and counted until the object dies.
  template <class Owner>
  py::capsule lend(std::shared_ptr<Owner> owner) {
    ++*count_;
    return py::capsule(new Lease{std::move(owner), count_, changes_}, kName, [](PyObject* capsule) {
      delete static_cast<Lease*>(PyCapsule_GetPointer(capsule, kName));
    });
  }
  int count() const { return *count_; }
  /// Counts a change of the lent memory.
  void changed() { ++*changes_; }
  /// Returns the count of changes of an array's memory if the array is a lease's or a view of one; else null.
  static std::shared_ptr<const std::uint64_t> changes(const py::array& array) {
    const Lease* lease = lease_of(array);
    return lease ? lease->changes : nullptr;
  }
  std::shared_ptr<const std::uint64_t> changes() const { return changes_; }
  /// Returns the owner of an array's memory if the array is a lease's or a view of one; else null.
  static const void* owner(const py::array& array) {
    const Lease* lease = lease_of(array);
    return lease ? lease->owner.get() : nullptr;
  }

 private:
  static constexpr const char* kName = "fieldmark lease";
  struct Lease {
    std::shared_ptr<void> owner;
    std::shared_ptr<int> count;
    std::shared_ptr<const std::uint64_t> changes;
    ~Lease() { --*count; }
  };
  static const Lease* lease_of(const py::array& array) {
    py::object base = array.base();
    while (base && py::isinstance<py::array>(base)) base = py::reinterpret_borrow<py::array>(base).base();
    if (!base || !PyCapsule_IsValid(base.ptr(), kName)) return nullptr;
    return static_cast<Lease*>(PyCapsule_GetPointer(base.ptr(), kName));
  }
  std::shared_ptr<int> count_ = std::make_shared<int>(0);
  std::shared_ptr<std::uint64_t> changes_ = std::make_shared<std::uint64_t>(0);
};

/// Returns an array over memory that `owner` keeps alive; `leases` counts it while it lives.
template <class T, class Owner>
py::array_t<T> view(T* elements, const Shape& shape, std::shared_ptr<Owner> owner, Leases& leases) {
  py::array_t<T> array(extents_of(shape), elements, leases.lend(std::move(owner)));
  return array;
}

/// As above, but read-only for Python.
template <class T, class Owner>
py::array_t<T> read_only_view(const T* elements, const Shape& shape, std::shared_ptr<Owner> owner,
                              Leases& leases) {
  py::array_t<T> array = view(const_cast<T*>(elements), shape, std::move(owner), leases);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

/// Largest extent, stride, padding or side of a window: their sums and products with an element's bytes are
/// then integers of 64 bits.
inline constexpr Index kMostPixels = (Index{1} << 31) - 1;

/// @param op, argument  for the error message   @throws ValueError unless least <= given <= most
inline void require_within(const std::string& op, const char* argument, Index given, Index least,
                           Index most = kMostPixels) {
  if (given < least || given > most)
    throw ValueError("[" + op + "] " + argument + " must be " + std::to_string(least) + " to " +
                     std::to_string(most) + ", got " + std::to_string(given));
}

void bind_engine(py::module_& module);
void bind_files(py::module_& module);
/// Binds gradient checks and products with Jacobians.
void bind_gradients(py::module_& module);
void bind_adam_group(py::module_& module);
/// Lets each function, method and constructor say which argument does not fit; comes after all of them.
void bind_refusals(py::module_& module);
/// Lets each class that cannot be pickled say what to use instead; comes after all of them.
void bind_pickling_refusals(py::module_& module);
void bind_fields(py::module_& module);
void bind_marks(py::module_& module);

}  // namespace fieldmark::python
