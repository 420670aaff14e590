#include <fieldmark/engine/ops/activation.h>

#include "kernels/elementwise.h"
#include "ops/chunks.h"

namespace fieldmark {
namespace kernels {
namespace {

// Derivation: dx = dy f'(x), with f' in terms of x or y, whichever is exact (kernels/elementwise.cpp).
// A chunk owns its elements of y and dx.
template <class T>
Var<T> unary(Unary f, Var<T> x, std::source_location from = std::source_location::current()) {
  const auto forward = FIELDMARK_KERNEL(unary_forward<T>);
  T* y = nullptr;
  Var<T> out = x.tape().output(x.shape(), &y, {x}, from);
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

#define FIELDMARK_UNARY(f)                       \
  template <class T>                             \
  Var<T> f(Var<T> x) {                           \
    return kernels::unary(kernels::Unary::f, x); \
  }                                              \
  template Var<float> f(Var<float>);             \
  template Var<double> f(Var<double>);
FIELDMARK_UNARY(relu)
FIELDMARK_UNARY(sigmoid)
FIELDMARK_UNARY(tanh)
FIELDMARK_UNARY(exp)
FIELDMARK_UNARY(truncated_exp)
FIELDMARK_UNARY(softplus)

}  // namespace fieldmark
