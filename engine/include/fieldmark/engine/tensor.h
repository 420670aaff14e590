#pragma once
#include <fieldmark/engine/shape.h>

#include <utility>
#include <vector>

namespace fieldmark {

/// Owning dense row-major tensor: parameters, images [height, width, channels], test inputs.
template <class T>
struct Tensor {
  Shape shape;          ///< extents; [0] for an empty tensor
  std::vector<T> data;  ///< shape.size() elements, the last axis fastest
  Tensor() : shape{0} {}
  /// Makes a tensor whose elements are all `fill`.
  explicit Tensor(Shape s, T fill = T(0)) : shape(s), data(static_cast<std::size_t>(s.size()), fill) {}
  /// @param d  shape.size() elements, row-major (not checked)
  Tensor(Shape s, std::vector<T> d) : shape(s), data(std::move(d)) {}
  /// Returns the number of elements.
  Index size() const { return static_cast<Index>(data.size()); }
  /// @{
  /// Returns the element at a row-major index (not checked).
  T& operator[](Index i) { return data[static_cast<std::size_t>(i)]; }
  const T& operator[](Index i) const { return data[static_cast<std::size_t>(i)]; }
  /// @}
};

}  // namespace fieldmark
