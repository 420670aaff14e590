#pragma once
#include <fieldmark/engine/shape.h>

#include <utility>
#include <vector>

namespace fieldmark {

/// Owning dense row-major tensor: parameters, images [height, width, channels], test inputs.
template <class T>
struct Tensor {
  Shape shape;
  std::vector<T> data;
  Tensor() : shape{0} {}
  explicit Tensor(Shape s, T fill = T(0)) : shape(s), data(static_cast<std::size_t>(s.size()), fill) {}
  Tensor(Shape s, std::vector<T> d) : shape(s), data(std::move(d)) {}
  Index size() const { return static_cast<Index>(data.size()); }
  T& operator[](Index i) { return data[static_cast<std::size_t>(i)]; }
  const T& operator[](Index i) const { return data[static_cast<std::size_t>(i)]; }
};

}  // namespace fieldmark
