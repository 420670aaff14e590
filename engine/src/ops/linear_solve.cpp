#include <fieldmark/engine/ops/linear_solve.h>

#include "ops/matrices.h"

namespace fieldmark {
namespace {

using detail::Matrix;

// Checks the rows of b and returns the number of its columns.
Index check_sides(const char* op, const Shape& a, const Shape& b) {
  const Index n = a[-1];
  if (b.rank() != a.rank() || b[-2] != n || detail::without_last(a, 2) != detail::without_last(b, 2))
    throw ShapeError(std::string("[") + op + "] b must be [.., n, k] with the axes of a but for its last, " +
                     a.str() + ", got shape " + b.str());
  return b[-1];
}

// Solves op(T) x = b for one of the triangles of a.
Matrix solve_triangle(const Matrix& a, const Matrix& b, bool upper, bool transposed) {
  if (transposed) return solve_triangle(a.transpose(), b, !upper, false);
  return upper ? Matrix(a.triangularView<Eigen::Upper>().solve(b))
               : Matrix(a.triangularView<Eigen::Lower>().solve(b));
}

Matrix triangle_of(const Matrix& m, bool upper) {
  return upper ? Matrix(m.triangularView<Eigen::Upper>()) : Matrix(m.triangularView<Eigen::Lower>());
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
  detail::for_matrices(batch, [&](Index i) {
    const Matrix m = triangle_of(detail::read_matrix(a.value() + i * n * n, n, n), t.upper);
    detail::check_finite("triangular_solve", i, m);
    check_diagonal(i, m);
    const Matrix right = detail::read_matrix(b.value() + i * n * k, n, k);
    detail::put_matrix(y + i * n * k, solve_triangle(m, right, t.upper, t.transposed), true);
  });

  // From op(T) x = b: op(T) dx + d(op(T)) x = db.
  a.tape().on_backward(out, [=](const T* dy) {
    T *da = a.grad_acc(), *db = b.grad_acc();
    detail::for_matrices(batch, [&](Index i) {
      const Matrix m = detail::read_matrix(a.value() + i * n * n, n, n),
                   x = detail::read_matrix(y + i * n * k, n, k);
      const Matrix g = solve_triangle(m, detail::read_matrix(dy + i * n * k, n, k), t.upper, !t.transposed);
      if (db) detail::put_matrix(db + i * n * k, g, false);
      if (!da) return;
      const Matrix full = t.transposed ? Matrix(-x * g.transpose()) : Matrix(-g * x.transpose());
      detail::put_matrix(da + i * n * n, triangle_of(full, t.upper), false);
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
  detail::for_matrices(batch, [&](Index i) {
    const auto lu = detail::decompose<T>("solve", i, detail::read_matrix(a.value() + i * n * n, n, n));
    detail::put_matrix(y + i * n * k, lu.solve(detail::read_matrix(b.value() + i * n * k, n, k)), true);
  });

  // From a dx + da x = db.
  a.tape().on_backward(out, [=](const T* dy) {
    T *da = a.grad_acc(), *db = b.grad_acc();
    detail::for_matrices(batch, [&](Index i) {
      const Matrix transposed = detail::read_matrix(a.value() + i * n * n, n, n).transpose();
      const Matrix g = transposed.partialPivLu().solve(detail::read_matrix(dy + i * n * k, n, k));
      if (db) detail::put_matrix(db + i * n * k, g, false);
      if (da)
        detail::put_matrix(da + i * n * n, -g * detail::read_matrix(y + i * n * k, n, k).transpose(), false);
    });
  });
  return out;
}

template <class T>
Var<T> inverse(Var<T> a) {
  const detail::Batch batch = detail::square_batch("inverse", a.shape());
  T* y = nullptr;
  const Var<T> out = a.tape().output(a.shape(), &y, {a});
  detail::for_matrices(batch, [&](Index i) {
    const auto m = detail::read_matrix(a.value() + i * batch.size(), batch.n, batch.n);
    detail::put_matrix(y + i * batch.size(), detail::decompose<T>("inverse", i, m).inverse(), true);
  });

  // From d(a y) = 0: dy = -y da y.
  a.tape().on_backward(out, [=](const T* dy) {
    bool fresh = false;
    T* da = a.grad_acc(&fresh);
    detail::for_matrices(batch, [&](Index i) {
      const Matrix yt = detail::read_matrix(y + i * batch.size(), batch.n, batch.n).transpose();
      detail::put_matrix(da + i * batch.size(),
                         -yt * detail::read_matrix(dy + i * batch.size(), batch.n, batch.n) * yt, fresh);
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
