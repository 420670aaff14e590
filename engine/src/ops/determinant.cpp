#include <fieldmark/engine/ops/determinant.h>

#include <cmath>
#include <numeric>
#include <span>

#include "ops/lu.h"

namespace fieldmark {
namespace {

using detail::Column;
using detail::Lu;
using detail::Matrix;
using detail::Workspace;

// Elements that cofactors() takes.
Index cofactors_size(Index n) { return 6 * Workspace::size(n, n) + 5 * Workspace::size(n); }

// Powers of two that bring the largest entry of each row into [1, 2); 0 for a row of zeros.
std::span<int> row_exponents(const Matrix& a, Workspace& w) {
  const std::span exponents(w.integers(a.rows()), at(a.rows()));
  for (Index i = 0; i < a.rows(); ++i) {
    const double largest = a.row(i).cwiseAbs().maxCoeff();
    exponents[at(i)] = largest > 0 ? -std::ilogb(largest) : 0;
  }
  return exponents;
}

void scale_rows(Matrix& a, std::span<const int> exponents) {
  for (Index i = 0; i < a.rows(); ++i)
    for (Index j = 0; j < a.cols(); ++j) a(i, j) = std::ldexp(a(i, j), exponents[at(i)]);
}

double determinant_of(const Matrix& m, Workspace w) {
  Matrix copy = w.matrix(m.rows(), m.rows());
  copy = m;
  return Lu(copy, w).determinant();
}

struct Svd {
  Matrix u, v;
  Column s;
};

// Makes the square matrix `a` diagonal, a = u a' v^T, by rotations of pairs of rows and columns. A pair is
// left if its entries off the diagonal are below twice the precision of the largest entry.
void rotate_to_diagonal(Matrix& a, Matrix& u, Matrix& v) {
  constexpr double kSmallest = std::numeric_limits<double>::min(),
                   kPrecision = 2 * std::numeric_limits<double>::epsilon();
  double largest = a.cwiseAbs().diagonal().maxCoeff();
  for (bool finished = false; !finished;) {
    finished = true;
    for (Index p = 1; p < a.rows(); ++p)
      for (Index q = 0; q < p; ++q) {
        const double threshold = std::max(kSmallest, kPrecision * largest);
        if (!(std::abs(a(p, q)) > threshold || std::abs(a(q, p)) > threshold)) continue;
        finished = false;
        Eigen::JacobiRotation<double> left, right;
        Eigen::internal::real_2x2_jacobi_svd(a, p, q, &left, &right);
        a.applyOnTheLeft(p, q, left);
        u.applyOnTheRight(p, q, left.transpose());
        a.applyOnTheRight(p, q, right);
        v.applyOnTheRight(p, q, right);
        largest = std::max({largest, std::abs(a(p, p)), std::abs(a(q, q))});
      }
  }
}

// a = u diag(s) v^T for a finite square matrix, s falling. The steps and bits are those of Eigen::JacobiSVD,
// which allocates. Changes a.
Svd decompose_singular(Matrix& a, Workspace& w) {
  const Index n = a.rows();
  Svd svd{w.matrix(n, n), w.matrix(n, n), w.column(n)};
  const double largest = a.cwiseAbs().maxCoeff(), scale = largest == 0 ? 1 : largest;
  a /= scale;
  svd.u.setIdentity();
  svd.v.setIdentity();
  rotate_to_diagonal(a, svd.u, svd.v);
  for (Index i = 0; i < n; ++i) {
    svd.s[i] = std::abs(a(i, i));
    if (a(i, i) < 0) svd.u.col(i) = -svd.u.col(i);
  }
  svd.s *= scale;
  for (Index i = 0; i < n; ++i) {
    Index place = 0;
    if (svd.s.tail(n - i).maxCoeff(&place) == 0) break;
    if (place == 0) continue;
    std::swap(svd.s[i], svd.s[i + place]);
    svd.u.col(i + place).swap(svd.u.col(i));
    svd.v.col(i + place).swap(svd.v.col(i));
  }
  return svd;
}

// d det(a) / da, the transposed adjugate. With a = U diag(s) V^T it is det(U) det(V) U diag(p) V^T, where p_i
// is the product of the other s. Changes a.
Matrix cofactors_by_svd(Matrix& a, Workspace& w) {
  const Index n = a.rows();
  const Svd svd = decompose_singular(a, w);
  Column others = w.column(n);
  for (Index i = 0; i < n; ++i) {
    others[i] = 1;
    for (Index j = 0; j < n; ++j)
      if (j != i) others[i] *= svd.s[j];
  }
  const double sign = determinant_of(svd.u, w) * determinant_of(svd.v, w) > 0 ? 1 : -1;
  Matrix left = w.matrix(n, n), c = w.matrix(n, n);
  left = sign * svd.u * others.asDiagonal();
  c.noalias() = left * svd.v.transpose();
  return c;
}

// The same via b = diag(2^e) a diag(2^f), whose rows and columns have similar magnitudes: small rows would
// drown in the error of the SVD. The cofactor of a_ij is that of b_ij times 2^(e_i + f_j), over the product
// of all powers. Changes a.
Matrix cofactors(Matrix& a, Workspace& w) {
  if (a.rows() == 0) return a;
  const std::span<int> rows = row_exponents(a, w);
  scale_rows(a, rows);
  a.transposeInPlace();
  const std::span<int> columns = row_exponents(a, w);
  scale_rows(a, columns);
  a.transposeInPlace();
  const int all =
      std::accumulate(rows.begin(), rows.end(), std::accumulate(columns.begin(), columns.end(), 0));
  for (int& e : rows) e -= all;
  Matrix c = cofactors_by_svd(a, w);
  for (Index i = 0; i < c.rows(); ++i)
    for (Index j = 0; j < c.cols(); ++j) c(i, j) = std::ldexp(c(i, j), rows[at(i)] + columns[at(j)]);
  return c;
}

// a^-T. Changes a.
Matrix transposed_inverse(Matrix& a, Workspace& w) {
  const Lu lu(a, w);
  Matrix x = w.matrix(a.rows(), a.rows()), transposed = w.matrix(a.rows(), a.rows());
  x.setIdentity();
  lu.solve(x);
  transposed = x.transpose();
  return transposed;
}

// y[i] = value(i, a_i, w), da_i = dy[i] slope(a_i, w); both may change the copy of a_i that they receive.
template <class T, class F, class D>
Var<T> of_each(const char* op, Var<T> a, F value, D slope,
               std::source_location from = std::source_location::current()) {
  const detail::Batch batch = detail::square_batch(op, a.shape());
  const Index n = batch.n;
  T* y = nullptr;
  const Var<T> out = a.tape().output(detail::without_last(a.shape(), 2), &y, {a}, from);
  const Index need = Workspace::size(n, n) + detail::decompose_size(n);
  detail::for_matrices(a.tape(), batch, need, [&](Index i, Workspace w) {
    Matrix m = w.read(a.value() + i * n * n, n, n);
    y[i] = static_cast<T>(value(i, m, w));
  });
  a.tape().on_backward(out, [a, batch, n, slope](const T* dy) {
    bool fresh = false;
    T* da = a.grad_acc(&fresh);
    detail::for_matrices(a.tape(), batch, cofactors_size(n), [&](Index i, Workspace w) {
      Matrix m = w.read(a.value() + i * n * n, n, n);
      detail::put_matrix(da + i * n * n, static_cast<double>(dy[i]) * slope(m, w), fresh);
    });
  });
  return out;
}

}  // namespace

template <class T>
Var<T> determinant(Var<T> a) {
  return of_each(
      "determinant", a,
      [](Index i, const Matrix& m, Workspace& w) {
        detail::check_finite("determinant", i, m);
        return Lu(m, w).determinant();
      },
      cofactors);
}

// d log |det a| = tr(a^-1 da).
template <class T>
Var<T> log_determinant(Var<T> a) {
  return of_each(
      "log_determinant", a,
      [](Index i, const Matrix& m, Workspace& w) {
        return detail::decompose<T>("log_determinant", i, m, w).diagonal().array().abs().log().sum();
      },
      transposed_inverse);
}

template Var<float> determinant(Var<float>);
template Var<double> determinant(Var<double>);
template Var<float> log_determinant(Var<float>);
template Var<double> log_determinant(Var<double>);

}  // namespace fieldmark
