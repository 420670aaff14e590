#include <fieldmark/engine/ops/comparison.h>
#include <fieldmark/engine/ops/layout.h>

#include "ops/broadcast.h"

namespace fieldmark {
namespace {

template <class T, class F>
Var<T> compare(const char* op, Var<T> a, Var<T> b, F holds,
               std::source_location from = std::source_location::current()) {
  const detail::Broadcast p(op, a.shape(), b.shape());
  T* y = nullptr;
  const Var<T> out = a.tape().output(p.shape, &y, {detach(a), detach(b)}, from);
  detail::for_broadcast(p, a.value(), b.value(), [&](Index i, Index n, const auto& va, const auto& vb) {
    detail::Out<T>(y + i, n) = holds(va, vb).template cast<T>();
  });
  a.tape().on_backward(out, [](const T*) {});
  return out;
}

}  // namespace

template <class T>
Var<T> greater(Var<T> a, Var<T> b) {
  return compare("greater", a, b, [](const auto& x, const auto& z) { return x > z; });
}

template <class T>
Var<T> less(Var<T> a, Var<T> b) {
  return compare("less", a, b, [](const auto& x, const auto& z) { return x < z; });
}

template <class T>
Var<T> equal(Var<T> a, Var<T> b) {
  return compare("equal", a, b, [](const auto& x, const auto& z) { return x == z; });
}

template <class T>
Var<T> where(Var<T> mask, Var<T> a, Var<T> b) {
  const Shape both = detail::Broadcast("where", a.shape(), b.shape()).shape;
  const Shape shape = detail::Broadcast("where: mask", both, mask.shape()).shape;
  const Var<T> m = broadcast_to(detach(mask), shape), x = broadcast_to(a, shape), z = broadcast_to(b, shape);
  const Index size = shape.size();
  T* y = nullptr;
  const Var<T> out = x.tape().output(shape, &y, {m, x, z});
  const T* mv = m.value();
  parallel_for(size, detail::kGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) y[i] = mv[i] != 0 ? x.value()[i] : z.value()[i];
  });

  // The gradient goes where the value came from. A chunk owns its elements.
  x.tape().on_backward(out, [x, z, mv](const T* dy) {
    detail::add_gradient(x, [=](Index i) { return mv[i] != 0 ? dy[i] : T(0); });
    detail::add_gradient(z, [=](Index i) { return mv[i] != 0 ? T(0) : dy[i]; });
  });
  return out;
}

#define FIELDMARK_COMPARE(f)                     \
  template Var<float> f(Var<float>, Var<float>); \
  template Var<double> f(Var<double>, Var<double>);
FIELDMARK_COMPARE(greater)
FIELDMARK_COMPARE(less)
FIELDMARK_COMPARE(equal)
#undef FIELDMARK_COMPARE
template Var<float> where(Var<float>, Var<float>, Var<float>);
template Var<double> where(Var<double>, Var<double>, Var<double>);

}  // namespace fieldmark
