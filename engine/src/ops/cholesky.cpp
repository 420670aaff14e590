#include <fieldmark/engine/ops/cholesky.h>

#include "ops/matrices.h"

namespace fieldmark {

using detail::Matrix;
using detail::Workspace;

template <class T>
Var<T> cholesky(Var<T> a) {
  const detail::Batch batch = detail::square_batch("cholesky", a.shape());
  const Index n = batch.n;
  T* y = nullptr;
  const Var<T> out = a.tape().output(a.shape(), &y, {a});
  const Index size = Workspace::size(n, n);
  detail::for_matrices(a.tape(), batch, 2 * size, [&](Index i, Workspace w) {
    const Matrix m = w.read(a.value() + i * n * n, n, n);
    Matrix l = w.matrix(n, n);
    l = (m + m.transpose()) / 2;
    detail::check_finite("cholesky", i, l);
    Eigen::Ref<Eigen::MatrixXd> in_place(l);
    if (Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(in_place).info() != Eigen::Success)
      detail::refuse_matrix("cholesky", i, "must be positive definite, got one that is not");
    detail::keep_triangle(l, false);
    detail::put_matrix(y + i * n * n, l, true);
  });

  // From da = dL L^T + L dL^T: L^-1 dL is the lower triangle, with half of the diagonal, of L^-1 da L^-T.
  a.tape().on_backward(out, [a, y, batch, n, size](const T* dy) {
    bool fresh = false;
    T* da = a.grad_acc(&fresh);
    detail::for_matrices(a.tape(), batch, 3 * size, [&](Index i, Workspace w) {
      const Matrix l = w.read(y + i * n * n, n, n);
      Matrix dl = w.read(dy + i * n * n, n, n), p = w.matrix(n, n);
      detail::keep_triangle(dl, false);
      p.noalias() = l.transpose() * dl;
      detail::keep_triangle(p, false);
      p.diagonal() /= 2;
      const auto up = l.transpose().template triangularView<Eigen::Upper>();
      up.solveInPlace(p);  // L^-T P
      Eigen::Map<detail::RowMajor<double>> transposed(p.data(), n, n);
      up.solveInPlace(transposed);  // p = L^-T P L^-1
      detail::put_matrix(da + i * n * n, (p + p.transpose()) / 2, fresh);
    });
  });
  return out;
}

template Var<float> cholesky(Var<float>);
template Var<double> cholesky(Var<double>);

}  // namespace fieldmark
