#include <fieldmark/engine/dual/matrices.h>
#include <fieldmark/engine/ops/math.h>
#include <fieldmark/engine/ops/operators.h>
#include <fieldmark/engine/ops/reduce_axes.h>

#include "dual/tangent.h"

namespace fieldmark {
namespace {

using detail::Tangent;
using detail::tangent_by;

// The tangent of a product that is linear in a and in b.
template <class T, class F>
Dual<T> bilinear(const Dual<T>& a, const Dual<T>& b, F product) {
  return detail::with_tangent(
      product(a.value(), b.value()),
      detail::plus<T>(tangent_by(a, [&](Var<T> t) { return product(t, b.value()); }),
                      tangent_by(b, [&](Var<T> t) { return product(a.value(), t); })));
}

// A layer y = act(sums(x, w, b)), where the sums are linear in x and in w and add the bias.
template <class T, class F>
Dual<T> layer(Var<T> y, const Dual<T>& x, const Dual<T>& w, const Dual<T>& b, Activation activation, F sums) {
  const Var<T> none = detail::filled(x.tape(), b.shape(), 0);
  auto t = detail::plus<T>(tangent_by(x, [&](Var<T> v) { return sums(v, w.value(), none); }),
                           tangent_by(w, [&](Var<T> v) { return sums(x.value(), v, none); }));
  t = detail::plus<T>(t, tangent_by(b, [](Var<T> v) { return v; }));
  if (t && t->shape() != y.shape()) t = broadcast_to(*t, y.shape());
  return detail::with_tangent(y, detail::rectified(activation == Activation::relu, y, t));
}

// Returns an [n, n] matrix with one value below, one on and one above the diagonal.
template <class T>
Var<T> triangles(Tape<T>& tape, Index n, double below, double diagonal, double above) {
  T* mask = tape.scratch(n * n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) mask[i * n + j] = static_cast<T>(j < i ? below : j == i ? diagonal : above);
  return tape.constant(mask, {n, n});
}

// tr(a^-1 a') of each matrix.
template <class T>
Var<T> trace_of_quotient(Var<T> a, Var<T> t) {
  return sum(transpose(inverse(a)) * t, {-2, -1});
}

}  // namespace

template <class T>
Dual<T> matmul(const Dual<T>& a, const Dual<T>& b) {
  return bilinear(a, b, [](Var<T> p, Var<T> q) { return matmul(p, q); });
}

template <class T>
Dual<T> batched_matmul(const Dual<T>& a, const Dual<T>& b) {
  return bilinear(a, b, [](Var<T> p, Var<T> q) { return batched_matmul(p, q); });
}

template <class T>
Dual<T> dense(const Dual<T>& x, const Dual<T>& w, const Dual<T>& b, Activation activation) {
  return layer(dense(x.value(), w.value(), b.value(), activation), x, w, b, activation,
               [](Var<T> p, Var<T> q, Var<T> r) { return dense(p, q, r); });
}

template <class T>
Dual<T> conv2d(const Dual<T>& x, const Dual<T>& w, const Dual<T>& b, Activation activation,
               ConvMethod method) {
  return layer(conv2d(x.value(), w.value(), b.value(), activation, method), x, w, b, activation,
               [=](Var<T> p, Var<T> q, Var<T> r) { return conv2d(p, q, r, Activation::none, method); });
}

template <class T>
Dual<T> conv2d(const Dual<T>& x, const Dual<T>& w, const Dual<T>& b, ConvWindow steps,
               Activation activation) {
  return layer(conv2d(x.value(), w.value(), b.value(), steps, activation), x, w, b, activation,
               [=](Var<T> p, Var<T> q, Var<T> r) { return conv2d(p, q, r, steps); });
}

// From op(T) x = b: op(T) x' = b' - op(T)' x.
template <class T>
Dual<T> triangular_solve(const Dual<T>& a, const Dual<T>& b, Triangle triangle) {
  const Var<T> x = triangular_solve(a.value(), b.value(), triangle);
  const auto of_a = [&](Var<T> t) {
    const Var<T> read = triangles(a.tape(), a.shape()[-1], triangle.upper ? 0 : 1, 1, triangle.upper ? 1 : 0);
    const Var<T> part = detail::only(read, t);
    return -batched_matmul(triangle.transposed ? transpose(part) : part, x);
  };
  const auto right = detail::plus<T>(tangent_by(b, [](Var<T> t) { return t; }), tangent_by(a, of_a));
  return detail::with_tangent<T>(x,
                                 right ? Tangent<T>(triangular_solve(a.value(), *right, triangle)) : right);
}

// From a x = b: a x' = b' - a' x.
template <class T>
Dual<T> solve(const Dual<T>& a, const Dual<T>& b) {
  const Var<T> x = solve(a.value(), b.value());
  const auto right = detail::plus<T>(tangent_by(b, [](Var<T> t) { return t; }),
                                     tangent_by(a, [&](Var<T> t) { return -batched_matmul(t, x); }));
  return detail::with_tangent<T>(x, right ? Tangent<T>(solve(a.value(), *right)) : right);
}

template <class T>
Dual<T> inverse(const Dual<T>& a) {
  const Var<T> y = inverse(a.value());
  return detail::with_tangent(y, a, [=](Var<T> t) { return -batched_matmul(batched_matmul(y, t), y); });
}

template <class T>
Dual<T> cholesky(const Dual<T>& a) {
  const Var<T> l = cholesky(a.value());
  return detail::with_tangent(l, a, [&](Var<T> t) {
    const Var<T> left = triangular_solve(l, T(0.5) * (t + transpose(t)));  // L^-1 a'
    const Var<T> both = triangular_solve(l, transpose(left));              // symmetric: L^-1 a' L^-T
    return batched_matmul(l, both * triangles(l.tape(), l.shape()[-1], 1, 0.5, 0));
  });
}

template <class T>
Dual<T> determinant(const Dual<T>& a) {
  const Var<T> y = determinant(a.value());
  return detail::with_tangent(y, a, [&](Var<T> t) { return y * trace_of_quotient(a.value(), t); });
}

template <class T>
Dual<T> log_determinant(const Dual<T>& a) {
  return detail::with_tangent(log_determinant(a.value()), a,
                              [&](Var<T> t) { return trace_of_quotient(a.value(), t); });
}

#define FIELDMARK_DUAL_MATRICES(T)                                                                 \
  template Dual<T> matmul(const Dual<T>&, const Dual<T>&);                                         \
  template Dual<T> batched_matmul(const Dual<T>&, const Dual<T>&);                                 \
  template Dual<T> dense(const Dual<T>&, const Dual<T>&, const Dual<T>&, Activation);              \
  template Dual<T> conv2d(const Dual<T>&, const Dual<T>&, const Dual<T>&, Activation, ConvMethod); \
  template Dual<T> conv2d(const Dual<T>&, const Dual<T>&, const Dual<T>&, ConvWindow, Activation); \
  template Dual<T> triangular_solve(const Dual<T>&, const Dual<T>&, Triangle);                     \
  template Dual<T> solve(const Dual<T>&, const Dual<T>&);                                          \
  template Dual<T> inverse(const Dual<T>&);                                                        \
  template Dual<T> cholesky(const Dual<T>&);                                                       \
  template Dual<T> determinant(const Dual<T>&);                                                    \
  template Dual<T> log_determinant(const Dual<T>&);
FIELDMARK_DUAL_MATRICES(float)
FIELDMARK_DUAL_MATRICES(double)
#undef FIELDMARK_DUAL_MATRICES

}  // namespace fieldmark
