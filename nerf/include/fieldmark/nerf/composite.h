#pragma once
#include <fieldmark/engine/tape.h>

#include <span>

namespace fieldmark::nerf {

/// Composites samples along packed rays: numerical quadrature of the volume rendering integral.
///
///   C_r = sum_i w_i c_i,   A_r = sum_i w_i,   w_i = T_i (1 - exp(-sigma_i delta_i)),
///   T_i = exp(-sum_{j<i} sigma_j delta_j)
///
/// Source: Mildenhall et al. 2020 (NeRF), eq. 3.
/// Samples of ray r are [ray_begin[r], ray_begin[r + 1]), near to far; a ray may have none.
/// @param sigma      [S]     density, 1/length, >= 0
/// @param rgb        [S, 3]  colour
/// @param delta      [S]     sample spacing, length, >= 0
/// @param ray_begin  R + 1 offsets, non-decreasing, first 0, last S; must outlive the pass
/// @return           [R, 4]  colour C_r and opacity A_r, background not added
/// @throws ShapeError if the three sample counts differ or rgb is not [S, 3]
/// @throws ValueError if ray_begin does not start at 0, decreases or does not end at S
/// Differentiable in: sigma, rgb, delta. Finite even where a ray saturates (T -> 0).
template <class T>
Var<T> composite(Var<T> sigma, Var<T> rgb, Var<T> delta, std::span<const Index> ray_begin);

}  // namespace fieldmark::nerf
