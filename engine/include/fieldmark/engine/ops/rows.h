#pragma once
#include <fieldmark/engine/tape.h>

#include <cstdint>
#include <span>

namespace fieldmark {

/// Repeats one row, such as a message code for every sample of a ray.
/// @param x [1, C] or [C]   @param rows  N, 0 or more   @return [N, C]
/// @throws ShapeError if x is not one row, or rows is negative
/// Differentiable in: x. The gradient sums the N rows in double.
template <class T>
Var<T> broadcast_rows(Var<T> x, Index rows);

/// Gathers rows of x by index: y[i] = x[index[i]].
/// @param x [R, C]   @param index  [N] in [0, R), in any order, repeats allowed
/// @return [N, C]
/// @throws ShapeError if x is not rank 2   @throws ValueError if an index is out of range
/// Differentiable in: x. The gradient of a row is summed in the order of index, for any thread count.
template <class T>
Var<T> gather_rows(Var<T> x, std::span<const std::int32_t> index);

}  // namespace fieldmark
