#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark {

/// Applies layer normalisation: scales each row of the last axis to mean 0 and variance 1, then applies a
/// gain and a shift.
///   y = gamma (x - mean) / sqrt(var + eps) + beta,   var = E[(x - mean)^2]
/// Source: Ba et al. 2016, eq. 4. A constant row gives beta exactly; statistics are kept in double.
/// @param x [.., C], C >= 1   @param gamma [C]   @param beta [C]   @param eps  > 0   @return [.., C]
/// @throws ShapeError if the shapes do not fit   @throws ValueError if eps is not above 0
/// Differentiable in: x, gamma, beta.
template <class T>
Var<T> layer_norm(Var<T> x, Var<T> gamma, Var<T> beta, double eps = 1e-5);

}  // namespace fieldmark
