#pragma once
#include <fieldmark/engine/dual.h>
#include <fieldmark/engine/ops/gather.h>
#include <fieldmark/engine/ops/layout.h>
#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/ops/resample.h>
#include <fieldmark/engine/ops/rows.h>
#include <fieldmark/engine/ops/slice.h>

#include <cstdint>
#include <initializer_list>
#include <span>
#include <vector>

namespace fieldmark {

// Ops that move, repeat or average elements, for Duals. They are linear, so the op of the tangent is the
// tangent of the result.

/// @{
/// Applies the op of layout.h with its tangent; pad() pads the tangent with zeros.
template <class T>
Dual<T> reshape(const Dual<T>& x, Shape shape);
template <class T>
Dual<T> permute(const Dual<T>& x, std::span<const int> order);
template <class T>
Dual<T> permute(const Dual<T>& x, std::initializer_list<int> order) {
  return permute(x, std::span<const int>(order.begin(), order.size()));
}
template <class T>
Dual<T> transpose(const Dual<T>& x, int a = -2, int b = -1);
template <class T>
Dual<T> broadcast_to(const Dual<T>& x, Shape shape);
template <class T>
Dual<T> pad(const Dual<T>& x, int axis, Index before, Index after, double value = 0);
template <class T>
Dual<T> cumsum(const Dual<T>& x, int axis = -1);
/// @}

/// Returns the values of x as a constant, without gradient and tangent.
template <class T>
Var<T> detach(const Dual<T>& x) {
  return detach(x.value());
}

/// @{
/// Applies the op of slice.h with its tangent. Pass a Var as Dual<T>(v).
template <class T>
Dual<T> concatenate(std::span<const Dual<T>> xs);
template <class T>
Dual<T> concatenate(std::initializer_list<Dual<T>> xs) {
  return concatenate(std::span<const Dual<T>>(xs.begin(), xs.size()));
}
template <class T>
Dual<T> concatenate(const std::vector<Dual<T>>& xs) {
  return concatenate(std::span<const Dual<T>>(xs));
}
template <class T>
Dual<T> concatenate(std::span<const Dual<T>> xs, int axis);
template <class T>
Dual<T> concatenate(std::initializer_list<Dual<T>> xs, int axis) {
  return concatenate(std::span<const Dual<T>>(xs.begin(), xs.size()), axis);
}
template <class T>
Dual<T> concatenate(const std::vector<Dual<T>>& xs, int axis) {
  return concatenate(std::span<const Dual<T>>(xs), axis);
}
template <class T>
Dual<T> slice(const Dual<T>& x, Index begin, Index count);
template <class T>
Dual<T> slice(const Dual<T>& x, int axis, Index begin, Index count);
/// @}

/// @{
/// Applies the op of gather.h or rows.h with its tangent.
template <class T>
Dual<T> gather(const Dual<T>& x, int axis, std::span<const std::int32_t> index);
template <class T>
Dual<T> scatter_add(const Dual<T>& x, int axis, std::span<const std::int32_t> index, Index extent);
template <class T>
Dual<T> broadcast_rows(const Dual<T>& x, Index rows);
template <class T>
Dual<T> gather_rows(const Dual<T>& x, std::span<const std::int32_t> index);
/// @}

/// @{
/// Applies the op of pool.h or resample.h with its tangent.
template <class T>
Dual<T> avg_pool(const Dual<T>& x, Index size);
template <class T>
Dual<T> global_avg_pool(const Dual<T>& x);
template <class T>
Dual<T> upsample_nearest(const Dual<T>& x, Index factor);
template <class T>
Dual<T> upsample_to(const Dual<T>& x, Index height, Index width,
                    Interpolation mode = Interpolation::bilinear);
template <class T>
Dual<T> space_to_depth(const Dual<T>& x);
/// @}

}  // namespace fieldmark
