#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark::nerf {

/// Encodes positions or directions by sines and cosines of rising frequency.
///   y = (sin(2^0 pi x), cos(2^0 pi x), ..., sin(2^(B-1) pi x), cos(2^(B-1) pi x)), each for all dimensions
///   of x
/// Source: Mildenhall et al. 2020 (NeRF), eq. 4. The argument is reduced exactly (2^b x modulo 2), so the
/// error does not grow with the band or the distance from the origin; only the effect of rounding x does.
/// @param x  [N, D], D at most 4   @param bands  B, 1 to 20   @return [N, 2 B D]
/// @throws ShapeError if x is not [N, D]   @throws ValueError if bands is out of range
/// Differentiable in: x.
template <class T>
Var<T> frequency_encoding(Var<T> x, int bands);
/// Computes the values of frequency_encoding() without recording or checks.
/// @param x  [n, dims]   @param y  [n, 2 bands dims], written
template <class T>
void frequency_values(const T* x, Index n, Index dims, int bands, T* y);

}  // namespace fieldmark::nerf
