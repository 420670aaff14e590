#pragma once
#include <fieldmark/engine/shape.h>

#include <span>

namespace fieldmark::nerf {

/// Points drawn from weights over intervals, by inversion of the piecewise linear distribution function:
///   p(s) = (w_i + f l_i / l) / l_i / (sum w + f) in interval i of length l_i,   l = sum l_i,
///   out_j = F^-1(u_j),   F(s) = integral of p to s
/// Source: Mildenhall et al. 2020 (NeRF), sec. 5.2. The floor f, 3e-4 of an opaque ray in all, is that of
/// its code (1e-5 in each of 31 intervals), spread by length: weights of zero give uniform points.
/// @param edge    n + 1 rising bounds of the intervals   @param weight  [n], >= 0, finite
/// @param u       [m] rising, in [0, 1]   @param out [m] written, rising, within the edges
/// @throws ShapeError if sizes do not fit or there is no interval
template <class T>
void importance_points(std::span<const T> edge, std::span<const T> weight, std::span<const T> u,
                       std::span<T> out);

}  // namespace fieldmark::nerf
