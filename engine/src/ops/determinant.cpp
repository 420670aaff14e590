#include <fieldmark/engine/ops/determinant.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "ops/matrices.h"

namespace fieldmark {
namespace {

using detail::Matrix;

// Powers of two that bring the largest entry of each row into [1, 2); 0 for a row of zeros.
std::vector<int> row_exponents(const Matrix& a) {
  std::vector<int> exponents;
  for (Index i = 0; i < a.rows(); ++i) {
    const double largest = a.row(i).cwiseAbs().maxCoeff();
    exponents.push_back(largest > 0 ? -std::ilogb(largest) : 0);
  }
  return exponents;
}

void scale_rows(Matrix& a, const std::vector<int>& exponents) {
  for (Index i = 0; i < a.rows(); ++i)
    for (Index j = 0; j < a.cols(); ++j)
      a(i, j) = std::ldexp(a(i, j), exponents[static_cast<std::size_t>(i)]);
}

// d det(a) / da, the transposed adjugate. With a = U diag(s) V^T it is det(U) det(V) U diag(p) V^T, where p_i
// is the product of the other s.
Matrix cofactors_by_svd(const Matrix& a) {
  const Index n = a.rows();
  const Eigen::JacobiSVD<Matrix> svd(a, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::VectorXd others(n);
  for (Index i = 0; i < n; ++i) {
    others[i] = 1;
    for (Index j = 0; j < n; ++j)
      if (j != i) others[i] *= svd.singularValues()[j];
  }
  const double sign = svd.matrixU().determinant() * svd.matrixV().determinant() > 0 ? 1 : -1;
  return sign * svd.matrixU() * others.asDiagonal() * svd.matrixV().transpose();
}

// The same via b = diag(2^e) a diag(2^f), whose rows and columns have similar magnitudes: small rows would
// drown in the error of the SVD. The cofactor of a_ij is that of b_ij times 2^(e_i + f_j), over the product
// of all powers.
Matrix cofactors(const Matrix& a) {
  if (a.rows() == 0) return a;
  Matrix b = a;
  std::vector<int> rows = row_exponents(b);
  scale_rows(b, rows);
  b.transposeInPlace();
  std::vector<int> columns = row_exponents(b);
  scale_rows(b, columns);
  b.transposeInPlace();
  const int all =
      std::accumulate(rows.begin(), rows.end(), std::accumulate(columns.begin(), columns.end(), 0));
  for (int& e : rows) e -= all;
  Matrix c = cofactors_by_svd(b);
  for (Index i = 0; i < c.rows(); ++i)
    for (Index j = 0; j < c.cols(); ++j)
      c(i, j) = std::ldexp(c(i, j), rows[static_cast<std::size_t>(i)] + columns[static_cast<std::size_t>(j)]);
  return c;
}

// y[i] = value(i, a_i), da_i = dy[i] slope(a_i).
template <class T, class F, class D>
Var<T> of_each(const char* op, Var<T> a, F value, D slope,
               std::source_location from = std::source_location::current()) {
  const detail::Batch batch = detail::square_batch(op, a.shape());
  T* y = nullptr;
  const Var<T> out = a.tape().output(detail::without_last(a.shape(), 2), &y, {a}, from);
  const auto matrix = [a, batch](Index i) {
    return detail::read_matrix(a.value() + i * batch.size(), batch.n, batch.n);
  };
  detail::for_matrices(batch, [&](Index i) { y[i] = static_cast<T>(value(i, matrix(i))); });
  a.tape().on_backward(out, [a, batch, matrix, slope](const T* dy) {
    bool fresh = false;
    T* da = a.grad_acc(&fresh);
    detail::for_matrices(batch, [&](Index i) {
      detail::put_matrix(da + i * batch.size(), static_cast<double>(dy[i]) * slope(matrix(i)), fresh);
    });
  });
  return out;
}

}  // namespace

template <class T>
Var<T> determinant(Var<T> a) {
  return of_each(
      "determinant", a,
      [](Index i, const Matrix& m) {
        detail::check_finite("determinant", i, m);
        return m.determinant();
      },
      cofactors);
}

// d log |det a| = tr(a^-1 da).
template <class T>
Var<T> log_determinant(Var<T> a) {
  return of_each(
      "log_determinant", a,
      [](Index i, const Matrix& m) {
        return detail::decompose<T>("log_determinant", i, m).matrixLU().diagonal().array().abs().log().sum();
      },
      [](const Matrix& m) { return Matrix(m.inverse().transpose()); });
}

template Var<float> determinant(Var<float>);
template Var<double> determinant(Var<double>);
template Var<float> log_determinant(Var<float>);
template Var<double> log_determinant(Var<double>);

}  // namespace fieldmark
