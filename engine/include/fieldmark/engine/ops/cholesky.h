#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark {

/// Computes the Cholesky factors of a batch of symmetric positive definite matrices: the lower triangular L
/// with L L^T = (a + a^T) / 2.
///   da = (S + S^T) / 2,   S = L^-T P(L^T dL) L^-1,   P: the lower triangle with half of the diagonal
/// Source: Murray 2016, Differentiation of the Cholesky decomposition, eq. 10.
/// @param a [.., n, n]; only the symmetric part of a matrix counts   @return [.., n, n], 0 above the diagonal
/// @throws ShapeError if the last axes are not square
/// @throws ValueError if a matrix is not positive definite or not finite
/// Differentiable in: a.
template <class T>
Var<T> cholesky(Var<T> a);

}  // namespace fieldmark
