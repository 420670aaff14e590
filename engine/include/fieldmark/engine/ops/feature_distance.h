#pragma once
#include <fieldmark/engine/tape.h>

#include <span>
#include <type_traits>

namespace fieldmark {

/// Computes the weighted squared distance of features scaled to unit length at every pixel, averaged over the
/// pixels.
///   y[n] = mean_p sum_c w_c (a[n, p, c] / (|a[n, p]| + e) - b[n, p, c] / (|b[n, p]| + e))^2,   e = 1e-10
/// Source: Zhang et al. 2018 (LPIPS), eq. 1, with the e of the authors' code.
/// @param a, b     [N, H, W, C] of one shape, H and W at least 1
/// @param weights  [C]
/// @return [N]; the sum over pixels runs in double. Float: lengths up to 1e18, whose squares still fit
/// @throws ShapeError if they do not fit
/// Differentiable in: a, b, except where a pixel's features are all 0: there the length has a kink, and the
/// gradient is 0 (after a ReLU it would not pass anyway).
template <class T>
Var<T> feature_distance(Var<T> a, Var<T> b, std::span<const std::type_identity_t<T>> weights);

}  // namespace fieldmark
