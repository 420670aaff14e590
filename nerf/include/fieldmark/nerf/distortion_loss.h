#pragma once
#include <fieldmark/engine/tape.h>

#include <span>
#include <type_traits>

namespace fieldmark::nerf {

/// Penalises the spread of a ray's weights along the ray: small where one thin surface has all the weight.
///   L = scale / R sum_r ( sum_ij w_i w_j |m_i - m_j| + 1/3 sum_i w_i^2 delta_i ),   w_i as in composite()
/// Source: Barron et al. 2022 (mip-NeRF 360), eq. 15, with lengths instead of normalised distances.
/// @param sigma      [S]  density, 1/length, >= 0
/// @param delta      [S]  sample spacing, length, >= 0
/// @param middle     [S]  position of a sample along its ray, length, not decreasing within a ray
/// @param ray_begin  R + 1 offsets, see composite(); it and the two spans must outlive the pass
/// @param scale      multiplies the loss, >= 0
/// @return [1]   @throws ShapeError if sizes do not match
/// @throws ValueError if ray_begin does not start at 0, decreases or does not end at S, or scale is negative
/// Differentiable in: sigma. Finite even where a ray saturates.
template <class T>
Var<T> distortion_loss(Var<T> sigma, std::span<const std::type_identity_t<T>> delta,
                       std::span<const std::type_identity_t<T>> middle, std::span<const Index> ray_begin,
                       double scale = 1);

}  // namespace fieldmark::nerf
