#include <fieldmark/engine/ops/eigenvalues.h>

#include <utility>

#include "ops/matrices.h"

namespace fieldmark {

namespace {

using detail::Column;
using detail::Matrix;
using detail::Workspace;

// Puts the eigenvectors in place of a symmetric matrix, and writes the eigenvalues, the smallest first. The
// steps and bits are those of Eigen::SelfAdjointEigenSolver, which allocates. Takes 3 columns. Returns false
// if they do not converge.
bool decompose_symmetric(Matrix& a, Column& values, Workspace w) {
  constexpr int kSweeps = 30;  // of QR steps a value
  const Index n = a.rows();
  if (n == 1) {
    values[0] = std::exchange(a(0, 0), 1.0);
    return true;
  }
  Column beside = w.column(n - 1), reflections = w.column(n - 1), memory = w.column(n);
  detail::keep_triangle(a, false);
  const double largest = a.cwiseAbs().maxCoeff(), scale = largest == 0 ? 1 : largest;
  a.triangularView<Eigen::Lower>() /= scale;
  Eigen::internal::tridiagonalization_inplace(a, reflections);
  values = a.diagonal();
  beside = a.diagonal<-1>();
  Eigen::HouseholderSequence<Matrix, Column>(a, reflections).setLength(n - 1).setShift(1).evalTo(a, memory);
  const auto info = Eigen::internal::computeFromTridiagonal_impl(values, beside, kSweeps, true, a);
  values *= scale;
  return info == Eigen::Success;
}

}  // namespace

template <class T>
Var<T> symmetric_eigenvalues(Var<T> a) {
  const detail::Batch batch = detail::square_batch("symmetric_eigenvalues", a.shape());
  const Index n = batch.n;
  T* y = nullptr;
  const Var<T> out = a.tape().output(detail::without_last(a.shape(), 1), &y, {a});
  auto* vectors = a.tape().template scratch<double>(batch.count * n * n);
  const Index size = Workspace::size(n, n), column = Workspace::size(n);
  detail::for_matrices(a.tape(), batch, 2 * size + 4 * column, [&](Index i, Workspace w) {
    const Matrix m = w.read(a.value() + i * n * n, n, n);
    detail::check_finite("symmetric_eigenvalues", i, m);
    if (n == 0) return;
    Matrix v = w.matrix(n, n);
    Column values = w.column(n);
    v = (m + m.transpose()) / 2;
    if (!decompose_symmetric(v, values, w))
      detail::refuse_matrix("symmetric_eigenvalues", i,
                            "must have eigenvalues that converge, got one without");
    detail::put_matrix(y + i * n, values, true);
    detail::put_matrix(vectors + i * n * n, v, true);
  });

  // dy_i = v_i^T da v_i.
  a.tape().on_backward(out, [a, vectors, batch, n, size, column](const T* dy) {
    bool fresh = false;
    T* da = a.grad_acc(&fresh);
    detail::for_matrices(a.tape(), batch, 3 * size + column, [&](Index i, Workspace w) {
      const Matrix v = w.read(vectors + i * n * n, n, n), d = w.read(dy + i * n, n, 1);
      Matrix scaled = w.matrix(n, n), g = w.matrix(n, n);
      scaled = v * d.col(0).asDiagonal();
      g.noalias() = scaled * v.transpose();
      detail::put_matrix(da + i * n * n, g, fresh);
    });
  });
  return out;
}

template Var<float> symmetric_eigenvalues(Var<float>);
template Var<double> symmetric_eigenvalues(Var<double>);

}  // namespace fieldmark
