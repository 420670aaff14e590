#pragma once
#include <fieldmark/engine/tape.h>

#include <span>
#include <type_traits>

namespace fieldmark::distort {

/// Adds Gaussian noise from given standard normal values; no clamp.
///   y_i = x_i + mu + sigma n_i
/// Source: Luo et al. 2023 (CopyRNeRF), distortion-resistant rendering; sigma is the true standard deviation
/// on the scale of x (the released code squares it).
/// @param x       [any] image, in [0, 1]
/// @param mu      [1] mean
/// @param sigma   [1] standard deviation, 0 to 1e6
/// @param normal  one standard normal value for each element of x; must outlive the pass
/// @return [x's shape]
/// @throws ShapeError if mu or sigma is not [1] or `normal` has another size than x
/// @throws ValueError if sigma is out of range
/// Differentiable in: x, mu, sigma.
template <class T>
Var<T> noise(Var<T> x, Var<T> mu, Var<T> sigma, std::span<const std::type_identity_t<T>> normal);
/// Overload with mean 0.
template <class T>
Var<T> noise(Var<T> x, Var<T> sigma, std::span<const std::type_identity_t<T>> normal);

}  // namespace fieldmark::distort
