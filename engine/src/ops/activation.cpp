#include <fieldmark/engine/ops/activation.h>

#include "kernels/elementwise.h"
#include "ops/pieces.h"

namespace fieldmark {
namespace kernels {
namespace {

// Derivation: dx = dy f'(x), with f' written in x or y, whichever is exact (kernels/elementwise.cpp).
// A piece owns its elements of y and dx.
template <class T>
Var<T> unary(Unary f, Var<T> x) {
  const auto forward = FIELDMARK_KERNEL(unary_forward<T>);
  T* y = nullptr;
  Var<T> out = x.tape().output(x.shape(), &y, {x});
  parallel_for(x.shape().size(), detail::kGrain,
               [&](Index begin, Index end) { forward(f, x.value() + begin, y + begin, end - begin); });

  x.tape().on_backward(out, [f, x, y](const T* dy) {
    const auto backward = FIELDMARK_KERNEL(unary_backward<T>);
    bool fresh = false;
    T* dx = x.grad_acc(&fresh);
    parallel_for(x.shape().size(), detail::kGrain, [&](Index begin, Index end) {
      backward(f, x.value() + begin, y + begin, dy + begin, dx + begin, !fresh, end - begin);
    });
  });
  return out;
}

}  // namespace
}  // namespace kernels

using kernels::Unary;

template <class T>
Var<T> relu(Var<T> x) {
  return kernels::unary(Unary::relu, x);
}
template <class T>
Var<T> sigmoid(Var<T> x) {
  return kernels::unary(Unary::sigmoid, x);
}
template <class T>
Var<T> tanh(Var<T> x) {
  return kernels::unary(Unary::tanh, x);
}
template <class T>
Var<T> exp(Var<T> x) {
  return kernels::unary(Unary::exp, x);
}
template <class T>
Var<T> truncated_exp(Var<T> x) {
  return kernels::unary(Unary::truncated_exp, x);
}
template <class T>
Var<T> softplus(Var<T> x) {
  return kernels::unary(Unary::softplus, x);
}

template Var<float> relu(Var<float>);
template Var<double> relu(Var<double>);
template Var<float> sigmoid(Var<float>);
template Var<double> sigmoid(Var<double>);
template Var<float> tanh(Var<float>);
template Var<double> tanh(Var<double>);
template Var<float> exp(Var<float>);
template Var<double> exp(Var<double>);
template Var<float> truncated_exp(Var<float>);
template Var<double> truncated_exp(Var<double>);
template Var<float> softplus(Var<float>);
template Var<double> softplus(Var<double>);

}  // namespace fieldmark
