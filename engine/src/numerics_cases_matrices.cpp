#include <fieldmark/engine/ops/cholesky.h>
#include <fieldmark/engine/ops/determinant.h>
#include <fieldmark/engine/ops/eigenvalues.h>
#include <fieldmark/engine/ops/linear_solve.h>

#include <Eigen/Dense>
#include <algorithm>

#include "numerics_cases_parts.h"

// The ops compute in double and round results to T once. An error is thus at most u_T |exact| for the
// rounding, plus n u_double amplified by the condition of the matrix. "condition" in the tables below is the
// amplified magnitude, scaled by kToType so that one limit in units of u_T bounds both.
namespace fieldmark {
namespace {

using Real = long double;
using ExactMatrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

template <class T>
constexpr Real kToType = static_cast<Real>(std::numeric_limits<double>::epsilon()) /
                         static_cast<Real>(std::numeric_limits<T>::epsilon());

template <class T>
ExactMatrix exact(const std::vector<T>& values, Index rows, Index columns) {
  using RowMajor = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor>(values.data(), rows, columns).template cast<Real>();
}

template <class T>
Tensor<T> rounded(const ExactMatrix& m) {
  Tensor<T> t({m.rows(), m.cols()});
  for (Index i = 0; i < t.size(); ++i) t[i] = static_cast<T>(m(i / m.cols(), i % m.cols()));
  return t;
}

ExactMatrix product(const ExactMatrix& a, const ExactMatrix& b) {
  ExactMatrix c = ExactMatrix::Zero(a.rows(), b.cols());
  for (Index i = 0; i < a.rows(); ++i)
    for (Index k = 0; k < a.cols(); ++k)
      for (Index j = 0; j < b.cols(); ++j) c(i, j) += a(i, k) * b(k, j);
  return c;
}

ExactMatrix size(const ExactMatrix& m) { return m.cwiseAbs(); }
ExactMatrix solved(const ExactMatrix& m, const ExactMatrix& b) { return m.partialPivLu().solve(b); }
ExactMatrix inverted(const ExactMatrix& m) { return solved(m, ExactMatrix::Identity(m.rows(), m.rows())); }

// The same for a triangle, by substitution: pivoting would mix rows of different magnitude.
ExactMatrix substituted(const ExactMatrix& m, const ExactMatrix& b) {
  const Index n = m.rows();
  const bool upper = m.isUpperTriangular();
  ExactMatrix x = b;
  for (Index k = 0; k < n; ++k) {
    const Index i = upper ? n - 1 - k : k;
    for (Index c = upper ? i + 1 : 0; c < (upper ? n : i); ++c) x.row(i) -= m(i, c) * x.row(c);
    x.row(i) /= m(i, i);
  }
  return x;
}
ExactMatrix lower(const ExactMatrix& m) { return m.triangularView<Eigen::Lower>(); }

// Errors of a matrix, each relative to its entry of `scale`.
template <class T>
void compare_matrix(const std::vector<T>& got, const ExactMatrix& want, const ExactMatrix& scale,
                    WorstError& error) {
  for (std::size_t i = 0; i < got.size(); ++i) {
    const Index r = static_cast<Index>(i) / want.cols(), c = static_cast<Index>(i) % want.cols();
    error.compare(got[i], want(r, c), size_of<T>(scale(r, c)));
  }
}

template <class T>
void compare_matrix(const std::vector<T>& got, const ExactMatrix& want, Real scale, WorstError& error) {
  compare_matrix(got, want, ExactMatrix::Constant(want.rows(), want.cols(), scale), error);
}

// 1 / (i + k + 1) in T: condition 9e5 for 5 rows and 4e13 for 10, near the limits of float and double.
template <class T>
Tensor<T> hilbert(Index n) {
  Tensor<T> a({n, n});
  for (Index i = 0; i < n * n; ++i) a[i] = static_cast<T>(1 / static_cast<double>(i / n + i % n + 1));
  return a;
}
template <class T>
constexpr Index kHardest = sizeof(T) == 4 ? 5 : 10;

// a x = b for Hilbert's matrix of 5 rows: the residual stays small whatever the condition.
template <class T>
void compare_residual(WorstError& error) {
  constexpr Index n = 5;
  const Tensor<T> a = hilbert<T>(n);
  Tensor<T> b({n, 1});
  for (Index i = 0; i < n * n; ++i) b[i / n] += a[i];
  Tape<T> tape;
  const Var<T> x = solve(tape.constant(a), tape.constant(b));
  for (Index i = 0; i < n; ++i) {
    Real residual = -b[i];
    for (Index k = 0; k < n; ++k) residual += static_cast<Real>(a[i * n + k]) * x.value()[k];
    error.compare(residual, 0, 1);
  }
}

// x and both gradients of m x = b. The error of a solve is n u |m^-1| |m| |x| (Higham 2002, section 9.3, with
// |L||U| as large as |m|), and da = -db x^T where a is read, or its transpose if m is a^T. `solve` gives the
// exact solutions.
template <class T>
void compare_solution(const std::vector<std::vector<T>>& got, const ExactMatrix& m,
                      ExactMatrix (*solve)(const ExactMatrix&, const ExactMatrix&), const ExactMatrix& b,
                      const ExactMatrix& cotangent, bool transposed, const ExactMatrix& read,
                      WorstError& error) {
  const ExactMatrix inverse = solve(m, ExactMatrix::Identity(m.rows(), m.rows())),
                    spread = product(size(inverse), size(m)),
                    spread_t = product(size(inverse).transpose(), size(m).transpose());
  const ExactMatrix x = solve(m, b), g = solve(m.transpose(), cotangent);
  const ExactMatrix off_x = kToType<T> * product(spread, size(x)),
                    off_g = kToType<T> * product(spread_t, size(g));
  compare_matrix(got[0], x, size(x) + off_x, error);
  compare_matrix(got[2], g, size(g) + off_g, error);
  ExactMatrix da = -product(g, x.transpose()),
              scale = product(size(g) + off_g, size(x).transpose()) + product(size(g), off_x.transpose());
  if (transposed) {
    da.transposeInPlace();
    scale.transposeInPlace();
  }
  compare_matrix(got[1], da.cwiseProduct(read), scale.cwiseProduct(read), error);
}

template <class T>
void compare_solve(WorstError& error) {
  constexpr Index n = kHardest<T>, k = 2;
  const Tensor<T> a = hilbert<T>(n), b = scattered<T>({n, k}, -1, 1, 1), g = scattered<T>({n, k}, -1, 1, 2);
  const auto got = values_and_gradients<T>([](auto&, const auto& v) { return solve(v[0], v[1]); }, {a, b},
                                           [&](Shape) -> const Tensor<T>& { return g; });
  const ExactMatrix m = exact(a.data, n, n);
  compare_solution(got, m, solved, exact(b.data, n, k), exact(g.data, n, k), false, ExactMatrix::Ones(n, n),
                   error);
}

// Triangles with a diagonal from 1 to 3e-4, off-diagonal entries up to 1, and NaN on the side that is not
// read.
template <class T>
void compare_triangular_solve(WorstError& error) {
  constexpr Index n = 8, k = 2;
  const Tensor<T> b = scattered<T>({n, k}, -1, 1, 1), g = scattered<T>({n, k}, -1, 1, 2);
  for (const bool upper : {false, true})
    for (const bool transposed : {false, true}) {
      Tensor<T> a = scattered<T>({n, n}, -1, 1, 3);
      ExactMatrix m = ExactMatrix::Zero(n, n), read = m;
      for (Index i = 0; i < n; ++i) {
        a[i * n + i] = static_cast<T>(std::pow(10.0, -0.5 * static_cast<double>(i)));
        for (Index c = 0; c < n; ++c) {
          read(i, c) = (upper ? c >= i : c <= i) ? 1 : 0;
          if (read(i, c) == 1)
            m(i, c) = a[i * n + c];
          else
            a[i * n + c] = std::numeric_limits<T>::quiet_NaN();
        }
      }
      const auto got = values_and_gradients<T>(
          [=](auto&, const auto& v) {
            return triangular_solve(v[0], v[1], {.upper = upper, .transposed = transposed});
          },
          {a, b}, [&](Shape) -> const Tensor<T>& { return g; });
      compare_solution(got, transposed ? ExactMatrix(m.transpose()) : m, substituted, exact(b.data, n, k),
                       exact(g.data, n, k), transposed, read, error);
    }
}

// y = a^-1 with errors |y| |a| |y|, and da = -y^T dy y^T, where y is rounded to T in between.
template <class T>
void compare_inverse(WorstError& error) {
  constexpr Index n = kHardest<T>;
  const Tensor<T> a = hilbert<T>(n), g = scattered<T>({n, n}, -1, 1, 2);
  const auto got = values_and_gradients<T>([](auto&, const auto& v) { return inverse(v[0]); }, {a},
                                           [&](Shape) -> const Tensor<T>& { return g; });
  const ExactMatrix m = exact(a.data, n, n), y = inverted(m), dy = exact(g.data, n, n);
  const ExactMatrix off = size(y) + kToType<T> * product(product(size(y), size(m)), size(y));
  compare_matrix(got[0], y, off, error);
  const ExactMatrix yt = y.transpose(), off_t = off.transpose();
  compare_matrix(got[1], -product(product(yt, dy), yt),
                 product(product(off_t, size(dy)), size(yt)) + product(product(size(yt), size(dy)), off_t),
                 error);
}

// For Hilbert's matrix of 5 rows. An error of L reaches the gradient through two solves with L, whose
// condition is 700.
template <class T>
void compare_cholesky(bool gradient, WorstError& error) {
  constexpr Index n = 5;
  const Tensor<T> a = hilbert<T>(n), g = scattered<T>({n, n}, -1, 1, 2);
  const auto got = values_and_gradients<T>([](auto&, const auto& v) { return cholesky(v[0]); }, {a},
                                           [&](Shape) -> const Tensor<T>& { return g; });
  const ExactMatrix m = exact(a.data, n, n), l = Eigen::LLT<ExactMatrix>(m).matrixL(), inverse = inverted(l);
  if (!gradient) return compare_matrix(got[0], l, size(l).maxCoeff(), error);
  ExactMatrix p = lower(product(l.transpose(), lower(exact(g.data, n, n))));
  p.diagonal() /= 2;
  const ExactMatrix s = product(product(inverse.transpose(), p), inverse), want = (s + s.transpose()) / 2;
  compare_matrix(got[1], want, size(want).maxCoeff(), error);
}

// A singular matrix has determinant 0 and the gradient of its cofactors.
template <class T>
void compare_singular_determinant(WorstError& error) {
  const Tensor<T> a({3, 3}, {1, 2, 3, 2, 4, 6, 1, 0, 1});
  const auto got =
      values_and_gradients<T>([](auto&, const auto& v) { return determinant(v[0]); }, {a}, ones<T>);
  const std::vector<Real> cofactors{4, 4, -4, -2, -2, 2, 0, 0, 0};
  error.compare(got[0][0], 0, 1);
  for (std::size_t i = 0; i < cofactors.size(); ++i) error.compare(got[1][i], cofactors[i], 1);
}

// Rows with magnitudes from 1e-12 to 1e12: each row of the gradient is relative to its own largest entry.
template <class T>
void compare_scaled_determinant(WorstError& error) {
  constexpr Index n = 5;
  Tensor<T> a = scattered<T>({n, n}, -1, 1, 7);
  for (Index i = 0; i < a.size(); ++i) a[i] *= static_cast<T>(std::pow(10.0, 6 * (i / n - 2)));
  const auto got =
      values_and_gradients<T>([](auto&, const auto& v) { return determinant(v[0]); }, {a}, ones<T>);
  const ExactMatrix m = exact(a.data, n, n), y = inverted(m);
  const Real det = m.determinant();
  error.compare(got[0][0], det, std::abs(det));
  const ExactMatrix want = det * y.transpose();
  compare_matrix(got[1], want, product(size(want).rowwise().maxCoeff(), ExactMatrix::Ones(1, n)), error);
}

// Determinants far beyond the range of double; the logarithm is relative to those of the pivots.
template <class T>
void compare_log_determinant(WorstError& error) {
  constexpr Index n = 40;
  for (const double level : {1e-12, 1e12}) {
    const Tensor<T> a = scattered<T>({n, n}, -level, level, 5);
    const auto got =
        values_and_gradients<T>([](auto&, const auto& v) { return log_determinant(v[0]); }, {a}, ones<T>);
    const ExactMatrix m = exact(a.data, n, n), y = inverted(m);
    const Eigen::PartialPivLU<ExactMatrix> lu(m);
    const Eigen::Array<Real, Eigen::Dynamic, 1> logs = lu.matrixLU().diagonal().array().abs().log();
    error.compare(got[0][0], logs.sum(), logs.abs().sum());
    const ExactMatrix scale = size(y) + kToType<T> * product(product(size(y), size(m)), size(y));
    compare_matrix(got[1], y.transpose(), scale.transpose(), error);
  }
}

// Three eigenvalues that differ by 512 units of rounding, a pair 1e-3 apart and one far away.
template <class T>
Tensor<T> clustered(double level) {
  constexpr Index n = 6;
  const Real close = 512 * static_cast<Real>(std::numeric_limits<T>::epsilon());
  Eigen::Matrix<Real, n, 1> values;
  values << -3, 1, 1 + close, 1 + 2 * close, 2, 2.001L;
  const ExactMatrix q =
      Eigen::HouseholderQR<ExactMatrix>(exact(scattered<double>({n, n}, -1, 1, 6).data, n, n)).householderQ();
  const ExactMatrix m = static_cast<Real>(level) * product(product(q, values.asDiagonal()), q.transpose());
  return rounded<T>((m + m.transpose()) / 2);
}

// Eigenvalues relative to the largest (Weyl), at three magnitudes.
template <class T>
void compare_eigenvalues(WorstError& error) {
  for (const double level : {1.0, 1e30, 1e-30}) {
    const Tensor<T> a = clustered<T>(level);
    const auto got = values_and_gradients<T>([](auto&, const auto& v) { return symmetric_eigenvalues(v[0]); },
                                             {a}, ones<T>);
    const Eigen::SelfAdjointEigenSolver<ExactMatrix> solver(exact(a.data, 6, 6), Eigen::EigenvaluesOnly);
    compare_matrix(got[0], solver.eigenvalues(), size(solver.eigenvalues()).maxCoeff(), error);
  }
}

// Near-equal eigenvalues have no eigenvectors of their own, but the gradient of a function that treats them
// alike is well defined: the projector onto their space. A single eigenvalue has an error of |a| / gap.
template <class T>
void compare_eigenvalue_gradients(WorstError& error) {
  constexpr Index n = 6;
  const Tensor<T> a = clustered<T>(1);
  const Eigen::SelfAdjointEigenSolver<ExactMatrix> solver(exact(a.data, n, n));
  const ExactMatrix v = solver.eigenvectors();
  const auto check = [&](std::vector<T> cotangent, Real scale) {
    const Tensor<T> g({n}, cotangent);
    const auto got = values_and_gradients<T>([](auto&, const auto& x) { return symmetric_eigenvalues(x[0]); },
                                             {a}, [&](Shape) -> const Tensor<T>& { return g; });
    const ExactMatrix d = exact(cotangent, n, 1);
    compare_matrix(got[1], product(product(v, d.col(0).asDiagonal()), v.transpose()), scale, error);
  };
  check({1, 1, 1, 1, 1, 1}, 1);
  check({0, 1, 1, 1, 0, 0}, 3);
  check({2, 0, 0, 0, -1, -1}, 3);
  check({0, 0, 0, 0, 1, 0}, 1 + kToType<T> * 3 / 1e-3L);
}

}  // namespace

void add_matrix_numerics(std::vector<NumericsCase>& cases) {
  add_numerics(cases, "linear_solve: residual of Hilbert's matrix", "1", 2e-7, 1e-15,
               [](auto t, WorstError& e) { compare_residual<decltype(t)>(e); });
  // 2 n u from the elimination with n = 10; in float, u from the rounding to float, and two such factors for
  // da.
  add_numerics(cases, "linear_solve: solve with Hilbert's matrix, gradients", "value, condition", 1.2e-7,
               2e-15, [](auto t, WorstError& e) { compare_solve<decltype(t)>(e); });
  // n u with n = 8.
  add_numerics(cases, "linear_solve: graded triangles, gradients", "value, condition", 1.2e-7, 9e-16,
               [](auto t, WorstError& e) { compare_triangular_solve<decltype(t)>(e); });
  add_numerics(cases, "linear_solve: inverse of Hilbert's matrix, gradient", "value, condition", 1.2e-7,
               2e-15, [](auto t, WorstError& e) { compare_inverse<decltype(t)>(e); });
  // Bounds: n u times the condition 9e5 of a, 5e-10; in float one rounding, times 2 * 700 in the gradient.
  // The measured errors are far below: 5e-15 and 1e-12, and 9e-8 for the gradient in float.
  add_numerics(cases, "cholesky: of Hilbert's matrix", "largest", 6e-8, 2e-14,
               [](auto t, WorstError& e) { compare_cholesky<decltype(t)>(false, e); });
  add_numerics(cases, "cholesky: gradient at Hilbert's matrix", "largest", 4e-7, 4e-12,
               [](auto t, WorstError& e) { compare_cholesky<decltype(t)>(true, e); });
  add_numerics(cases, "determinant: a singular matrix", "1", 1e-6, 1e-14,
               [](auto t, WorstError& e) { compare_singular_determinant<decltype(t)>(e); });
  // A few n u with n = 5; in float one rounding.
  add_numerics(cases, "determinant: rows from 1e-12 to 1e12, gradient", "row", 6e-8, 5e-15,
               [](auto t, WorstError& e) { compare_scaled_determinant<decltype(t)>(e); });
  // n u with n = 40; in float one rounding.
  add_numerics(cases, "determinant: logarithms of 1e-480 and 1e480", "pivots, condition", 6e-8, 5e-15,
               [](auto t, WorstError& e) { compare_log_determinant<decltype(t)>(e); });
  // A few n u with n = 6; in float one rounding.
  add_numerics(cases, "eigenvalues: near-equal ones at 1e-30, 1 and 1e30", "largest", 6e-8, 3e-15,
               [](auto t, WorstError& e) { compare_eigenvalues<decltype(t)>(e); });
  add_numerics(cases, "eigenvalues: gradients of near-equal ones", "1, size / gap", 6e-8, 3e-15,
               [](auto t, WorstError& e) { compare_eigenvalue_gradients<decltype(t)>(e); });
}

}  // namespace fieldmark
