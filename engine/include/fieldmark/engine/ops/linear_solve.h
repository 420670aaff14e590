#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark {

// Batches of matrices of up to some hundred rows; the axes before the last two index the batch. Eigen does
// the work, in double.
// @throws ShapeError if the shapes do not fit   @throws ValueError if a matrix is singular, even if only to
// the working precision of the scalar type, or holds a NaN or an infinity

/// Which triangle of a matrix triangular_solve() reads, and how.
struct Triangle {
  bool upper = false;       ///< the upper one instead of the lower
  bool transposed = false;  ///< solves with the triangle's transpose
};

/// Solves T x = b, where T is a triangle of a with its diagonal. The other triangle is not read.
///   db = T^-T dx,   da = the triangle of -db x^T (transposed: of -x db^T)
/// @param a [.., n, n]   @param b [.., n, k]   @return x [.., n, k]
/// Differentiable in: a, b.
template <class T>
Var<T> triangular_solve(Var<T> a, Var<T> b, Triangle triangle = {});

/// Solves a x = b by LU decomposition with pivots.
///   db = a^-T dx,   da = -db x^T
/// @param a [.., n, n]   @param b [.., n, k]   @return x [.., n, k]
/// Differentiable in: a, b.
template <class T>
Var<T> solve(Var<T> a, Var<T> b);

/// Computes the inverse matrices y = a^-1.
///   da = -y^T dy y^T
/// @param a [.., n, n]   @return [.., n, n]
/// Differentiable in: a.
template <class T>
Var<T> inverse(Var<T> a);

}  // namespace fieldmark
