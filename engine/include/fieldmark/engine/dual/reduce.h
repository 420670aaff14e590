#pragma once
#include <fieldmark/engine/dual.h>
#include <fieldmark/engine/ops/reduce.h>
#include <fieldmark/engine/ops/reduce_axes.h>
#include <fieldmark/engine/ops/softmax.h>

#include <span>
#include <type_traits>

namespace fieldmark {

/// @{
/// Applies the op of reduce.h; its tangent is the op of the tangent.
template <class T>
Dual<T> sum(const Dual<T>& x);
template <class T>
Dual<T> mean(const Dual<T>& x);
template <class T>
Dual<T> weighted_mean(const Dual<T>& x, std::span<const std::type_identity_t<T>> weights);
/// @}

/// @{
/// Applies the op of reduce_axes.h with its tangent.
///   sum, mean: of x'   variance: 2 mean((x - mean) x')   max: x' at the largest element
///   logsumexp: sum exp(x - y) x'   softmax: y (x' - sum y x')
template <class T>
Dual<T> sum(const Dual<T>& x, const Axes& axes, KeepAxes keep = KeepAxes::no);
template <class T>
Dual<T> mean(const Dual<T>& x, const Axes& axes, KeepAxes keep = KeepAxes::no);
template <class T>
Dual<T> variance(const Dual<T>& x, const Axes& axes, KeepAxes keep = KeepAxes::no);
template <class T>
Dual<T> max(const Dual<T>& x, const Axes& axes, KeepAxes keep = KeepAxes::no);
template <class T>
Dual<T> logsumexp(const Dual<T>& x, const Axes& axes, KeepAxes keep = KeepAxes::no);
template <class T>
Dual<T> softmax(const Dual<T>& x, int axis);
template <class T>
Dual<T> softmax(const Dual<T>& x);
/// @}

}  // namespace fieldmark
