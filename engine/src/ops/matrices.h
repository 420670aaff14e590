#pragma once
// Batches of small matrices in double, computed by Eigen. Private.
#include <fieldmark/engine/shape_checks.h>

#include <Eigen/Dense>
#include <limits>
#include <string>

#include "ops/axes.h"

namespace fieldmark::detail {

using Matrix = Eigen::MatrixXd;
template <class T>
using RowMajor = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

template <class T>
Matrix read_matrix(const T* p, Index rows, Index columns) {
  return Eigen::Map<const RowMajor<T>>(p, rows, columns).template cast<double>();
}

// to = or += m.
template <class T>
void put_matrix(T* to, const Matrix& m, bool assign) {
  Eigen::Map<RowMajor<T>> out(to, m.rows(), m.cols());
  if (assign)
    out = m.cast<T>();
  else
    out += m.cast<T>();
}

// Extents of [.., n, n].
struct Batch {
  Index count, n;
  Index size() const { return n * n; }
};

inline Batch square_batch(const char* op, const Shape& s) {
  if (s.rank() < 2 || s[-1] != s[-2])
    throw ShapeError(std::string("[") + op + "] a must be square matrices [.., n, n], got shape " + s.str());
  Batch batch{1, s[-1]};
  for (int k = 0; k + 2 < s.rank(); ++k) batch.count *= s[k];
  return batch;
}

// Returns the shape without its last `axes` axes.
inline Shape without_last(const Shape& s, int axes) {
  std::array<Index, Shape::kMaxRank> extents{};
  for (int k = 0; k + axes < s.rank(); ++k) extents[at(k)] = s[k];
  return Shape(std::span(extents).first(at(s.rank() - axes)));
}

// Calls f(which) for the matrices of a batch, in parallel; each call owns the data of its matrix.
template <class F>
void for_matrices(Batch b, F f) {
  parallel_for(b.count, std::max<Index>(1, kGrain / std::max<Index>(1, b.n * b.n * b.n)),
               [&](Index begin, Index end) {
                 for (Index i = begin; i < end; ++i) f(i);
               });
}

[[noreturn]] inline void refuse_matrix(const char* op, Index which, const std::string& why) {
  throw ValueError(std::string("[") + op + "] a: matrix " + std::to_string(which) + " " + why);
}

inline void check_finite(const char* op, Index which, const Matrix& m) {
  if (!m.allFinite()) refuse_matrix(op, which, "must be finite, got a NaN or an infinity");
}

// Computes the LU decomposition of a matrix that is invertible in the precision of T.
template <class T>
Eigen::PartialPivLU<Matrix> decompose(const char* op, Index which, const Matrix& m) {
  check_finite(op, which, m);
  Eigen::PartialPivLU<Matrix> lu(m);
  // Eigen's estimate divides by the pivots: a pivot of 0 gives NaN, which the estimate can lose.
  const bool zero_pivot = (lu.matrixLU().diagonal().array() == 0).any();
  const double rcond = zero_pivot ? 0 : m.rows() == 0 ? 1 : lu.rcond();
  if (!(rcond >= static_cast<double>(std::numeric_limits<T>::epsilon()))) {
    char text[80];
    std::snprintf(text, sizeof text, "must not be singular, got the reciprocal condition number %.2g", rcond);
    refuse_matrix(op, which, text);
  }
  return lu;
}

}  // namespace fieldmark::detail
