#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark::nerf {

constexpr Index kSphericalHarmonics = 16;  ///< functions of degree 0 to 3

/// Computes the real spherical harmonics of degree 0 to 3, orthonormal on the unit sphere, in the order m =
/// -l .. l of each degree. Source: Sloan 2013, Efficient Spherical Harmonic Evaluation; used for directions
/// by Mueller et al. 2022. They are evaluated as polynomials in x, y and z, also for directions that are not
/// of unit length.
/// @param d  [N, 3] unit directions   @return [N, 16]   @throws ShapeError if d is not [N, 3]
/// Differentiable in: d (as three independent coordinates).
template <class T>
Var<T> spherical_harmonics(Var<T> d);

}  // namespace fieldmark::nerf
