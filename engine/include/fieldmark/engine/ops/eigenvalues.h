#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark {

/// Computes the eigenvalues of a batch of symmetric matrices, in ascending order.
///   da = V diag(dy) V^T,   V the eigenvectors
/// @param a [.., n, n]; only the symmetric part (a + a^T) / 2 of a matrix counts
/// @return [.., n]
/// @throws ShapeError if the last axes are not square   @throws ValueError if a matrix is not finite
/// Differentiable in: a, where the eigenvalues differ; of equal ones, only symmetric functions such as sums
/// have a gradient.
template <class T>
Var<T> symmetric_eigenvalues(Var<T> a);

}  // namespace fieldmark
