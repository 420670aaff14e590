#include <fieldmark/engine/ops/cholesky.h>

#include "ops/matrices.h"

namespace fieldmark {

using detail::Matrix;

template <class T>
Var<T> cholesky(Var<T> a) {
  const detail::Batch batch = detail::square_batch("cholesky", a.shape());
  const Index n = batch.n;
  T* y = nullptr;
  const Var<T> out = a.tape().output(a.shape(), &y, {a});
  detail::for_matrices(batch, [&](Index i) {
    const Matrix m = detail::read_matrix(a.value() + i * n * n, n, n), symmetric = (m + m.transpose()) / 2;
    detail::check_finite("cholesky", i, symmetric);
    const Eigen::LLT<Matrix> llt(symmetric);
    if (llt.info() != Eigen::Success)
      detail::refuse_matrix("cholesky", i, "must be positive definite, got one that is not");
    detail::put_matrix(y + i * n * n, llt.matrixL(), true);
  });

  // From da = dL L^T + L dL^T: L^-1 dL is the lower triangle, with half of the diagonal, of L^-1 da L^-T.
  a.tape().on_backward(out, [a, y, batch, n](const T* dy) {
    bool fresh = false;
    T* da = a.grad_acc(&fresh);
    detail::for_matrices(batch, [&](Index i) {
      const Matrix l = detail::read_matrix(y + i * n * n, n, n);
      const Matrix all = detail::read_matrix(dy + i * n * n, n, n), dl = all.triangularView<Eigen::Lower>();
      const Matrix product = l.transpose() * dl;
      Matrix p = product.triangularView<Eigen::Lower>();
      p.diagonal() /= 2;
      const auto up = l.transpose().template triangularView<Eigen::Upper>();
      const Matrix left = up.solve(p);                          // L^-T P
      const Matrix s = up.solve(left.transpose()).transpose();  // L^-T P L^-1
      detail::put_matrix(da + i * n * n, (s + s.transpose()) / 2, fresh);
    });
  });
  return out;
}

template Var<float> cholesky(Var<float>);
template Var<double> cholesky(Var<double>);

}  // namespace fieldmark
