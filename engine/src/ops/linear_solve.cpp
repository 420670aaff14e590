#include <fieldmark/engine/ops/linear_solve.h>

#include "ops/lu.h"

namespace fieldmark {
namespace {

using detail::Matrix;
using detail::Workspace;

// Checks the rows of b and returns the number of its columns.
Index check_sides(const char* op, const Shape& a, const Shape& b) {
  const Index n = a[-1];
  if (b.rank() != a.rank() || b[-2] != n || detail::without_last(a, 2) != detail::without_last(b, 2))
    throw ShapeError(std::string("[") + op + "] b must be [.., n, k] with the axes of a but for its last, " +
                     a.str() + ", got shape " + b.str());
  return b[-1];
}

// x = a^-1 x for one of the triangles of a.
void solve_triangle(const Matrix& a, Matrix& x, bool upper) {
  if (upper)
    a.triangularView<Eigen::Upper>().solveInPlace(x);
  else
    a.triangularView<Eigen::Lower>().solveInPlace(x);
}

void check_diagonal(Index which, const Matrix& a) {
  for (Index i = 0; i < a.rows(); ++i)
    if (a(i, i) == 0)
      detail::refuse_matrix("triangular_solve", which,
                            "must not be singular, got 0 on the diagonal in row " + std::to_string(i));
}

}  // namespace

template <class T>
Var<T> triangular_solve(Var<T> a, Var<T> b, Triangle t) {
  const detail::Batch batch = detail::square_batch("triangular_solve", a.shape());
  const Index n = batch.n, k = check_sides("triangular_solve", a.shape(), b.shape());
  T* y = nullptr;
  const Var<T> out = a.tape().output(b.shape(), &y, {a, b});
  const Index size = Workspace::size(n, n), sides = Workspace::size(n, k);
  detail::for_matrices(a.tape(), batch, 2 * size + sides, [&](Index i, Workspace w) {
    Matrix m = w.read(a.value() + i * n * n, n, n), x = w.read(b.value() + i * n * k, n, k);
    detail::keep_triangle(m, t.upper);
    detail::check_finite("triangular_solve", i, m);
    check_diagonal(i, m);
    solve_triangle(t.transposed ? w.read_transposed(a.value() + i * n * n, n, n) : m, x,
                   t.upper != t.transposed);
    detail::put_matrix(y + i * n * k, x, true);
  });

  // From op(T) x = b: op(T) dx + d(op(T)) x = db.
  a.tape().on_backward(out, [=](const T* dy) {
    T *da = a.grad_acc(), *db = b.grad_acc();
    detail::for_matrices(a.tape(), batch, 2 * size + 2 * sides, [&](Index i, Workspace w) {
      const T* m = a.value() + i * n * n;
      Matrix g = w.read(dy + i * n * k, n, k);
      solve_triangle(t.transposed ? w.read(m, n, n) : w.read_transposed(m, n, n), g, t.upper == t.transposed);
      if (db) detail::put_matrix(db + i * n * k, g, false);
      if (!da) return;
      const Matrix x = w.read(y + i * n * k, n, k);
      Matrix all = w.matrix(n, n);
      if (t.transposed)
        all.noalias() = -x * g.transpose();
      else
        all.noalias() = -g * x.transpose();
      detail::keep_triangle(all, t.upper);
      detail::put_matrix(da + i * n * n, all, false);
    });
  });
  return out;
}

template <class T>
Var<T> solve(Var<T> a, Var<T> b) {
  const detail::Batch batch = detail::square_batch("solve", a.shape());
  const Index n = batch.n, k = check_sides("solve", a.shape(), b.shape());
  T* y = nullptr;
  const Var<T> out = a.tape().output(b.shape(), &y, {a, b});
  const Index size = Workspace::size(n, n), sides = Workspace::size(n, k);
  detail::for_matrices(a.tape(), batch, size + sides + detail::decompose_size(n), [&](Index i, Workspace w) {
    const Matrix m = w.read(a.value() + i * n * n, n, n);
    Matrix x = w.read(b.value() + i * n * k, n, k);
    detail::decompose<T>("solve", i, m, w).solve(x);
    detail::put_matrix(y + i * n * k, x, true);
  });

  // From a dx + da x = db.
  a.tape().on_backward(out, [=](const T* dy) {
    T *da = a.grad_acc(), *db = b.grad_acc();
    const Index need = 2 * size + 2 * sides + detail::Lu::size(n);
    detail::for_matrices(a.tape(), batch, need, [&](Index i, Workspace w) {
      const Matrix transposed = w.read_transposed(a.value() + i * n * n, n, n);
      Matrix g = w.read(dy + i * n * k, n, k);
      detail::Lu(transposed, w).solve(g);
      if (db) detail::put_matrix(db + i * n * k, g, false);
      if (!da) return;
      const Matrix x = w.read(y + i * n * k, n, k);
      Matrix all = w.matrix(n, n);
      all.noalias() = -g * x.transpose();
      detail::put_matrix(da + i * n * n, all, false);
    });
  });
  return out;
}

template <class T>
Var<T> inverse(Var<T> a) {
  const detail::Batch batch = detail::square_batch("inverse", a.shape());
  T* y = nullptr;
  const Var<T> out = a.tape().output(a.shape(), &y, {a});
  const Index n = batch.n, size = Workspace::size(n, n);
  detail::for_matrices(a.tape(), batch, 2 * size + detail::decompose_size(n), [&](Index i, Workspace w) {
    const Matrix m = w.read(a.value() + i * n * n, n, n);
    Matrix x = w.matrix(n, n);
    x.setIdentity();
    detail::decompose<T>("inverse", i, m, w).solve(x);
    detail::put_matrix(y + i * n * n, x, true);
  });

  // From d(a y) = 0: dy = -y da y.
  a.tape().on_backward(out, [=](const T* dy) {
    bool fresh = false;
    T* da = a.grad_acc(&fresh);
    detail::for_matrices(a.tape(), batch, 4 * size, [&](Index i, Workspace w) {
      const Matrix yt = w.read_transposed(y + i * n * n, n, n), g = w.read(dy + i * n * n, n, n);
      Matrix left = w.matrix(n, n), all = w.matrix(n, n);
      left.noalias() = -yt * g;
      all.noalias() = left * yt;
      detail::put_matrix(da + i * n * n, all, fresh);
    });
  });
  return out;
}

#define FIELDMARK_LINEAR_SOLVE(T)                             \
  template Var<T> triangular_solve(Var<T>, Var<T>, Triangle); \
  template Var<T> solve(Var<T>, Var<T>);                      \
  template Var<T> inverse(Var<T>);
FIELDMARK_LINEAR_SOLVE(float)
FIELDMARK_LINEAR_SOLVE(double)
#undef FIELDMARK_LINEAR_SOLVE

}  // namespace fieldmark
