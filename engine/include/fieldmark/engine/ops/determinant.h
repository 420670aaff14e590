#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark {

/// Determinants of matrices, in batches.
///   da = dy adj(a)^T, from the singular values, so that it holds for singular matrices too
/// @param a [.., n, n]   @return [..]
/// @throws ShapeError if the last axes are not square   @throws ValueError if a matrix is not finite
/// Differentiable in: a.
template <class T>
Var<T> determinant(Var<T> a);

/// log |det a| of matrices, in batches, where determinants overflow.
///   da = dy a^-T
/// @param a [.., n, n]   @return [..]
/// @throws ShapeError if the last axes are not square
/// @throws ValueError if a matrix is singular, also to the working precision of the scalar type, or not
/// finite Differentiable in: a.
template <class T>
Var<T> log_determinant(Var<T> a);

}  // namespace fieldmark
