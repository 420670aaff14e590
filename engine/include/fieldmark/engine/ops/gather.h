#pragma once
#include <fieldmark/engine/tape.h>

#include <cstdint>
#include <span>

namespace fieldmark {

/// Gathers entries of an axis by index: y[.., i, ..] = x[.., index[i], ..].
/// @param x  axis `axis` of extent R; a negative axis counts from the last
/// @param index  [N] in [0, R), in any order, repeats allowed
/// @return the shape of x with N instead of R
/// @throws ShapeError if the axis is out of range   @throws ValueError if an index is out of range
/// Differentiable in: x. The gradient of an entry is summed in the order of index, for any thread count.
template <class T>
Var<T> gather(Var<T> x, int axis, std::span<const std::int32_t> index);

/// Adds up the entries of an axis by index: y[.., r, ..] = sum of x[.., i, ..] over the i with index[i] = r,
/// in their order; 0 where there are none. The transpose of gather().
/// @param index  [N] in [0, extent), one for each of the N entries of x on the axis
/// @return the shape of x with `extent` instead of N
/// @throws ShapeError if the axis is out of range or the length of index differs from N
/// @throws ValueError if an index is out of range      Differentiable in: x.
template <class T>
Var<T> scatter_add(Var<T> x, int axis, std::span<const std::int32_t> index, Index extent);

}  // namespace fieldmark
