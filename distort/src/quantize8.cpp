#include "fieldmark/distort/quantize8.h"

#include <fieldmark/engine/parallel.h>

namespace fieldmark::distort {

namespace {
constexpr Index kQuantizeGrain = Index{1} << 14;
}

template <class T>
Var<T> quantize8(Var<T> x) {
  const Index n = x.shape().size();
  T* y = nullptr;
  const Var<T> out = x.tape().output(x.shape(), &y, {x});
  parallel_for(n, kQuantizeGrain, [=](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      const T v = x.value()[i] * 255;
      // Adds a half and truncates: std::round is a function call on x86-64-v1.
      y[i] = v >= 255 ? T(1) : v > 0 ? static_cast<T>(static_cast<int>(v + T(0.5))) / 255 : T(0);
    }
  });
  // dx = dy inside [0, 1]; chunks own their dx.
  x.tape().on_backward(out, [x, n](const T* dy) {
    T* dx = x.grad_acc();
    parallel_for(n, kQuantizeGrain, [=](Index begin, Index end) {
      for (Index i = begin; i < end; ++i)
        if (x.value()[i] >= 0 && x.value()[i] <= 1) dx[i] += dy[i];
    });
  });
  return out;
}

template Var<float> quantize8(Var<float>);
template Var<double> quantize8(Var<double>);

}  // namespace fieldmark::distort
