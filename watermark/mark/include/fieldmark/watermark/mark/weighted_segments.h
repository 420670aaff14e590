#pragma once
#include <fieldmark/engine/tape.h>

#include <span>
#include <type_traits>

namespace fieldmark::watermark {

/// Computes weighted sums over consecutive rows, as volume rendering does to colours once the weights are
/// fixed.
///   y[p, :] = sum_{begin[p] <= k < begin[p + 1]} weights[k] x[k, :]
/// @param x  [S, C]   @param begin  P + 1 offsets, first 0, last S, non-decreasing   @param weights  [S];
/// both must outlive the pass   @return [P, C]   @throws ShapeError, ValueError if they do not fit
/// Differentiable in: x.
template <class T>
Var<T> weighted_segments(Var<T> x, std::span<const std::int32_t> begin,
                         std::span<const std::type_identity_t<T>> weights);

}  // namespace fieldmark::watermark
