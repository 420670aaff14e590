#pragma once
#include <fieldmark/engine/tape.h>

#include <array>
#include <initializer_list>
#include <span>

namespace fieldmark {

/// The axes that a reduction removes: {0}, {-1}, {1, 2}; negative ones count from the last.
class Axes {
 public:
  /// @throws ValueError if there are more than Shape::kMaxRank
  Axes(std::initializer_list<int> axes);
  /// Overload for a list whose length is known only at run time.
  explicit Axes(std::span<const int> axes);
  /// Returns the axes as given.
  std::span<const int> list() const { return std::span(axes_).first(static_cast<std::size_t>(count_)); }

 private:
  std::array<int, Shape::kMaxRank> axes_{};
  int count_ = 0;
};

/// Whether to keep a reduced axis with extent 1, so that the result broadcasts against the input.
enum class KeepAxes { no, yes };

// All functions reduce over the named axes. Sums run in double, with the same bits for any thread count.
// @throws ShapeError if an axis is out of range   @throws ValueError if an axis is named twice

/// Computes the sum over some axes; 0 where there is nothing to add.
/// Differentiable in: x.
template <class T>
Var<T> sum(Var<T> x, const Axes& axes, KeepAxes keep = KeepAxes::no);

/// Computes the mean over some axes.
/// @throws ShapeError if there is nothing to average      Differentiable in: x.
template <class T>
Var<T> mean(Var<T> x, const Axes& axes, KeepAxes keep = KeepAxes::no);

/// Computes the variance over some axes: the mean of (x - mean)^2, dividing by the number of elements.
/// @throws ShapeError if there is nothing to average      Differentiable in: x.
template <class T>
Var<T> variance(Var<T> x, const Axes& axes, KeepAxes keep = KeepAxes::no);

/// Finds the largest element over some axes; NaN if any element is NaN.
/// @throws ShapeError if there is no element
/// Differentiable in: x, where the largest is unique; else the gradient goes to the first in row-major order.
template <class T>
Var<T> max(Var<T> x, const Axes& axes, KeepAxes keep = KeepAxes::no);

/// Computes log sum exp(x) over some axes, shifted by the largest so that nothing overflows.
/// @throws ShapeError if there is nothing to add
/// Differentiable in: x; dy/dx is the softmax, 0 where all x are -infinity.
template <class T>
Var<T> logsumexp(Var<T> x, const Axes& axes, KeepAxes keep = KeepAxes::no);

/// Applies softmax over one axis, see softmax.h.
/// @throws ShapeError if the axis is out of range or empty      Differentiable in: x.
template <class T>
Var<T> softmax(Var<T> x, int axis);

}  // namespace fieldmark
