#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/shape_checks.h>

#include "ops/chunks.h"

namespace fieldmark {
namespace {

template <class T, class F>
Var<T> map(Shape shape, std::initializer_list<Var<T>> inputs, F f) {
  T* y = nullptr;
  Var<T> out = inputs.begin()->tape().output(shape, &y, inputs);
  parallel_for(shape.size(), detail::kGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) y[i] = f(i);
  });
  return out;
}

// In each backward below a chunk owns its elements of the gradients.

}  // namespace

template <class T>
Var<T> add(Var<T> a, Var<T> b) {
  check_same("add", "a", a.shape(), "b", b.shape());
  const T *av = a.value(), *bv = b.value();
  Var<T> out = map(a.shape(), {a, b}, [=](Index i) { return av[i] + bv[i]; });
  a.tape().on_backward(out, [a, b](const T* dy) {
    detail::add_gradient(a, [=](Index i) { return dy[i]; });
    detail::add_gradient(b, [=](Index i) { return dy[i]; });
  });
  return out;
}

template <class T>
Var<T> sub(Var<T> a, Var<T> b) {
  check_same("sub", "a", a.shape(), "b", b.shape());
  const T *av = a.value(), *bv = b.value();
  Var<T> out = map(a.shape(), {a, b}, [=](Index i) { return av[i] - bv[i]; });
  a.tape().on_backward(out, [a, b](const T* dy) {
    detail::add_gradient(a, [=](Index i) { return dy[i]; });
    detail::add_gradient(b, [=](Index i) { return -dy[i]; });
  });
  return out;
}

template <class T>
Var<T> mul(Var<T> a, Var<T> b) {
  check_same("mul", "a", a.shape(), "b", b.shape());
  const T *av = a.value(), *bv = b.value();
  Var<T> out = map(a.shape(), {a, b}, [=](Index i) { return av[i] * bv[i]; });
  a.tape().on_backward(out, [a, b, av, bv](const T* dy) {
    detail::add_gradient(a, [=](Index i) { return dy[i] * bv[i]; });
    detail::add_gradient(b, [=](Index i) { return dy[i] * av[i]; });
  });
  return out;
}

template <class T>
Var<T> scale(Var<T> x, double factor) {
  const T* xv = x.value();
  const T f = static_cast<T>(factor);
  Var<T> out = map(x.shape(), {x}, [=](Index i) { return f * xv[i]; });
  x.tape().on_backward(out,
                       [x, f](const T* dy) { detail::add_gradient(x, [=](Index i) { return f * dy[i]; }); });
  return out;
}

template Var<float> add(Var<float>, Var<float>);
template Var<double> add(Var<double>, Var<double>);
template Var<float> sub(Var<float>, Var<float>);
template Var<double> sub(Var<double>, Var<double>);
template Var<float> mul(Var<float>, Var<float>);
template Var<double> mul(Var<double>, Var<double>);
template Var<float> scale(Var<float>, double);
template Var<double> scale(Var<double>, double);

}  // namespace fieldmark
