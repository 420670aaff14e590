#include <fieldmark/engine/ops/matmul.h>
#include <fieldmark/engine/shape_checks.h>

#include "ops/product.h"

namespace fieldmark {

template <class T>
Var<T> matmul(Var<T> a, Var<T> b) {
  check_rank("matmul", "a", a.shape(), 2, "[m, k]");
  check_rank("matmul", "b", b.shape(), 2, "[k, n]");
  const Index m = a.shape()[0], k = a.shape()[1], n = b.shape()[1];
  check_extent("matmul", "b", b.shape(), 0, k, "the columns of a", a.shape());
  Tape<T>& tape = a.tape();
  T* y = nullptr;
  const Var<T> out = tape.output({m, n}, &y, {a, b});
  detail::product<T>({.m = m,
                      .n = n,
                      .k = k,
                      .a = a.value(),
                      .a_row = k,
                      .b = detail::packed(tape, b.value(), k, n, n, Index{1}),
                      .c = y,
                      .ldc = n});

  // dA = dY B^T, dB = A^T dY.
  tape.on_backward(out, [a, b, m, k, n](const T* dy) {
    Tape<T>& t = a.tape();
    if (T* da = a.grad_acc())
      detail::product<T>({.m = m,
                          .n = k,
                          .k = n,
                          .a = dy,
                          .a_row = n,
                          .b = detail::packed(t, b.value(), n, k, Index{1}, n),
                          .c = da,
                          .ldc = k,
                          .accumulate = true});
    if (T* db = b.grad_acc())
      detail::product<T>({.m = k,
                          .n = n,
                          .k = m,
                          .a = a.value(),
                          .a_row = 1,
                          .a_col = k,
                          .b = detail::packed(t, dy, m, n, n, Index{1}),
                          .c = db,
                          .ldc = n,
                          .accumulate = true});
  });
  return out;
}

template Var<float> matmul(Var<float>, Var<float>);
template Var<double> matmul(Var<double>, Var<double>);

}  // namespace fieldmark
