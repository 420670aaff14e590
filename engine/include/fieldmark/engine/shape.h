#pragma once
#include <fieldmark/core/error.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>

namespace fieldmark {

/// Counts and positions of elements.
using Index = std::int64_t;
/// Converts a position to the index type of standard containers. @param i  0 or more (not checked)
inline std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Extents of a dense row-major tensor, rank 0 to 5. Trivially copyable: a backward closure can hold one by
/// value.
class Shape {
 public:
  static constexpr int kMaxRank = 5;  ///< maximum number of axes
  Shape() = default;
  /// @param dims  extents, 0 or more, the slowest axis first
  /// @throws ShapeError if there are more than kMaxRank, one is negative, or the number of elements overflows
  Shape(std::initializer_list<Index> dims) : Shape(std::span(dims.begin(), dims.size())) {}
  /// Overload for a list whose length is known only at run time.
  explicit Shape(std::span<const Index> dims) : rank_(static_cast<int>(dims.size())) {
    if (dims.size() > kMaxRank) [[unlikely]]
      throw ShapeError("[shape] a shape has at most " + std::to_string(kMaxRank) + " axes, got " +
                       std::to_string(dims.size()));
    Index all = 1;  // with every 0 taken as 1: bounds the product of any of the extents
    for (std::size_t k = 0; k < dims.size(); ++k) {
      const Index n = dims[k];
      if (n < 0 || __builtin_mul_overflow(all, n > 0 ? n : 1, &all)) [[unlikely]]
        refuse(dims);
      dims_[k] = n;
      size_ *= n;
    }
  }
  /// Returns the number of axes, 0 to kMaxRank.
  int rank() const { return rank_; }
  /// Returns the extent of an axis in [-rank, rank) (not checked, see check_axis()). Negative axes count from
  /// the last.
  Index operator[](int axis) const { return dims_[static_cast<std::size_t>(axis < 0 ? axis + rank_ : axis)]; }
  /// Returns the number of elements; 1 for rank 0.
  Index size() const { return size_; }
  /// True if rank and all extents are equal.
  friend bool operator==(const Shape& a, const Shape& b) {
    bool equal = a.rank_ == b.rank_;
    for (std::size_t k = 0; k < kMaxRank; ++k) equal &= a.dims_[k] == b.dims_[k];
    return equal;
  }
  /// Returns the shape as in error texts: "[2, 3]".
  std::string str() const { return listed(std::span(dims_).first(static_cast<std::size_t>(rank_))); }

 private:
  static std::string listed(std::span<const Index> dims) {
    std::string s = "[";
    for (std::size_t k = 0; k < dims.size(); ++k) s += (k ? ", " : "") + std::to_string(dims[k]);
    return s + "]";
  }
  [[noreturn, gnu::cold]] static void refuse(std::span<const Index> dims) {
    throw ShapeError("[shape] extents must be 0 or more, and their product below 2^63, got " + listed(dims));
  }
  std::array<Index, kMaxRank> dims_{};
  Index size_ = 1;
  int rank_ = 0;
};

}  // namespace fieldmark
