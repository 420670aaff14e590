#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark {

/// Computes the determinants of a batch of matrices.
///   da = dy adj(a)^T, from the singular values, so that it holds for singular matrices too
/// @param a [.., n, n]   @return [..]
/// @throws ShapeError if the last axes are not square   @throws ValueError if a matrix is not finite
/// Differentiable in: a.
template <class T>
Var<T> determinant(Var<T> a);

/// Computes log |det a| of a batch of matrices, even where the determinants overflow.
///   da = dy a^-T
/// @param a [.., n, n]   @return [..]
/// @throws ShapeError if the last axes are not square
/// @throws ValueError if a matrix is not finite, or is singular, even if only to the working precision of the
/// scalar type
/// Differentiable in: a.
template <class T>
Var<T> log_determinant(Var<T> a);

}  // namespace fieldmark
