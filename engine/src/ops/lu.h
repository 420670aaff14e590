#pragma once
// LU decompositions of small matrices, in memory of a Workspace. Private.
#include <cmath>
#include <cstdio>
#include <limits>

#include "ops/matrices.h"

namespace fieldmark::detail {

// P a = L U with partial pivoting. The steps and bits are those of Eigen::PartialPivLU, which allocates.
class Lu {
 public:
  static constexpr Index size(Index n) { return Workspace::size(n); }

  // Decomposes in place: `a` then holds L and U. Takes size(n) elements.
  Lu(const Matrix& a, Workspace& w) : lu_(a), swaps_(w.integers(a.rows())) {
    const Index n = a.rows();
    if (n == 0) return;
    norm_ = lu_.cwiseAbs().colwise().sum().maxCoeff();
    Eigen::internal::partial_lu_impl<double, Eigen::ColMajor, int>::blocked_lu(n, n, lu_.data(), n, swaps_,
                                                                               swapped_);
  }

  Index rows() const { return lu_.rows(); }
  auto diagonal() const { return lu_.diagonal(); }
  double norm() const { return norm_; }  // largest sum of magnitudes of a column of a

  double determinant() const {
    return rows() == 0 ? 1 : (swapped_ % 2 == 0 ? 1.0 : -1.0) * diagonal().prod();
  }
  // x = a^-1 x.
  template <class X>
  void solve(X& x) const {
    for (Index k = 0; k < rows(); ++k) x.row(k).swap(x.row(swaps_[k]));
    lu_.triangularView<Eigen::UnitLower>().solveInPlace(x);
    lu_.triangularView<Eigen::Upper>().solveInPlace(x);
  }
  // x = a^-T x.
  template <class X>
  void solve_transposed(X& x) const {
    lu_.triangularView<Eigen::Upper>().transpose().solveInPlace(x);
    lu_.triangularView<Eigen::UnitLower>().transpose().solveInPlace(x);
    for (Index k = rows() - 1; k >= 0; --k) x.row(k).swap(x.row(swaps_[k]));
  }

 private:
  Matrix lu_;
  int* swaps_;
  int swapped_ = 0;
  double norm_ = 0;
};

// Estimates the largest sum of magnitudes of a column of a^-1 for n > 1.
// Source: Higham 1988 (FORTRAN codes for estimating the one-norm of a real or complex matrix), algorithms 4.1
// and 5.1, with the steps of Eigen::PartialPivLU::rcond(), which allocates.
inline double inverse_norm(const Lu& a, Workspace w) {
  const Index n = a.rows();
  Column v = w.column(n), sign = w.column(n), sign_before = w.column(n);
  v.setConstant(1 / static_cast<double>(n));
  a.solve(v);
  double bound = v.lpNorm<1>(), bound_before = bound;
  Index largest = -1, largest_before = -1;
  for (int k = 0; k < 4; ++k) {
    for (Index i = 0; i < n; ++i) sign[i] = v[i] < 0 ? -1 : 1;
    if (k > 0 && sign == sign_before) break;
    v = sign;
    a.solve_transposed(v);
    v.cwiseAbs().maxCoeff(&largest);
    if (largest == largest_before) break;
    v.setZero();
    v[largest] = 1;
    a.solve(v);
    bound = v.lpNorm<1>();
    if (bound <= bound_before) break;
    sign_before = sign;
    largest_before = largest;
    bound_before = bound;
  }
  for (Index i = 0; i < n; ++i)
    v[i] = (i % 2 == 0 ? 1 : -1) * (1 + static_cast<double>(i) / static_cast<double>(n - 1));
  a.solve(v);
  return std::max(bound, 2 * v.lpNorm<1>() / (3 * static_cast<double>(n)));
}

// Estimates the reciprocal condition number.
inline double reciprocal_condition(const Lu& a, const Workspace& w) {
  // The estimate divides by the pivots: a pivot of 0 gives NaN, which the estimate can lose.
  if ((a.diagonal().array() == 0).any()) return 0;
  if (a.rows() < 2) return 1;
  const double inverse = inverse_norm(a, w);
  return inverse == 0 ? 0 : 1 / inverse / a.norm();
}

// Elements that decompose() takes.
constexpr Index decompose_size(Index n) { return Lu::size(n) + 3 * Workspace::size(n); }

// Decomposes a matrix, in place, that is invertible in the precision of T.
template <class T>
Lu decompose(const char* op, Index which, const Matrix& m, Workspace& w) {
  check_finite(op, which, m);
  const Lu lu(m, w);
  const double rcond = reciprocal_condition(lu, w);
  if (!(rcond >= static_cast<double>(std::numeric_limits<T>::epsilon()))) {
    char text[80];
    std::snprintf(text, sizeof text, "must not be singular, got the reciprocal condition number %.2g", rcond);
    refuse_matrix(op, which, text);
  }
  return lu;
}

}  // namespace fieldmark::detail
