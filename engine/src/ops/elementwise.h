#pragma once
// Elementwise work as Eigen expressions over parallel chunks. Private.
#include <Eigen/Core>

#include "ops/chunks.h"

namespace fieldmark::detail {

template <class T>
using Array = Eigen::Array<T, Eigen::Dynamic, 1>;
template <class T>
using In = Eigen::Map<const Array<T>>;
template <class T>
using Out = Eigen::Map<Array<T>>;

// to = or += what: the first gradient to arrive is assigned.
template <class To, class Expression>
void put(To to, const Expression& what, bool assign) {
  if (assign)
    to = what;
  else
    to += what;
}

// y = f(x) with its backward dx = slope(x, y, dy), both array expressions. A chunk owns its elements. `from`
// names the op for an observer.
template <class T, class F, class D>
Var<T> elementwise(Var<T> x, F f, D slope, std::source_location from = std::source_location::current()) {
  const Index size = x.shape().size();
  T* y = nullptr;
  const Var<T> out = x.tape().output(x.shape(), &y, {x}, from);
  parallel_for(size, kGrain, [&](Index begin, Index end) {
    Out<T>(y + begin, end - begin) = f(In<T>(x.value() + begin, end - begin));
  });
  x.tape().on_backward(out, [x, y, slope](const T* dy) {
    bool fresh = false;
    T* dx = x.grad_acc(&fresh);
    parallel_for(x.shape().size(), kGrain, [&](Index begin, Index end) {
      const auto part = [&](const T* p) { return In<T>(p + begin, end - begin); };
      put(Out<T>(dx + begin, end - begin), slope(part(x.value()), part(y), part(dy)), fresh);
    });
  });
  return out;
}

}  // namespace fieldmark::detail
