#include <fieldmark/engine/ops/eigenvalues.h>

#include "ops/matrices.h"

namespace fieldmark {

using detail::Matrix;

template <class T>
Var<T> symmetric_eigenvalues(Var<T> a) {
  const detail::Batch batch = detail::square_batch("symmetric_eigenvalues", a.shape());
  const Index n = batch.n;
  T* y = nullptr;
  const Var<T> out = a.tape().output(detail::without_last(a.shape(), 1), &y, {a});
  auto* vectors = a.tape().template scratch<double>(batch.count * n * n);
  detail::for_matrices(batch, [&](Index i) {
    const Matrix m = detail::read_matrix(a.value() + i * n * n, n, n);
    detail::check_finite("symmetric_eigenvalues", i, m);
    if (n == 0) return;
    const Eigen::SelfAdjointEigenSolver<Matrix> solver((m + m.transpose()) / 2);
    detail::put_matrix(y + i * n, solver.eigenvalues(), true);
    detail::put_matrix(vectors + i * n * n, solver.eigenvectors(), true);
  });

  // dy_i = v_i^T da v_i.
  a.tape().on_backward(out, [a, vectors, batch, n](const T* dy) {
    bool fresh = false;
    T* da = a.grad_acc(&fresh);
    detail::for_matrices(batch, [&](Index i) {
      const Matrix v = detail::read_matrix(vectors + i * n * n, n, n),
                   d = detail::read_matrix(dy + i * n, n, 1);
      detail::put_matrix(da + i * n * n, v * d.col(0).asDiagonal() * v.transpose(), fresh);
    });
  });
  return out;
}

template Var<float> symmetric_eigenvalues(Var<float>);
template Var<double> symmetric_eigenvalues(Var<double>);

}  // namespace fieldmark
