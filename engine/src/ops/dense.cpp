#include <fieldmark/engine/ops/dense.h>

#include "ops/product.h"

namespace fieldmark {
namespace {

constexpr Index kShardRows = 4096;  // rows of a partial sum of the weights' gradient

// dY (through the ReLU) in panels serves twice: as B of dW = X^T dY, and as A of dX = dY W^T, whose segments
// are the panels.
template <class T>
void backward(Var<T> x, Var<T> w, Var<T> b, const T* y, const T* dy, Index n, bool relu) {
  Tape<T>& tape = x.tape();
  const Index in = w.shape()[0], out = w.shape()[1], panel = detail::panel_width<T>(out);
  const Index panels = detail::round_up(out, panel) / panel;
  const T* d = detail::packed(tape, dy, n, out, out, Index{1}, relu ? y : nullptr);
  if (T* dw = w.grad_acc())
    detail::sharded_sum(tape, n, kShardRows, dw, in * out, [&](Index begin, Index end, T* to) {
      using namespace kernels;
      FIELDMARK_KERNEL(gemm<T>)
      ({.m = in,
        .n = out,
        .k = end - begin,
        .a = x.value() + begin * in,
        .a_row = 1,
        .a_col = in,
        .b = d + begin * panel,
        .b_panel = n * panel,
        .c = to,
        .ldc = out,
        .accumulate = true});
    });
  if (T* db = b.grad_acc()) detail::add_column_sums(d, n, out, db);
  bool fresh = false;
  if (T* dx = x.grad_acc(&fresh)) {
    const T* transposed = w.packed() ? w.packed()->transposed : nullptr;
    if (!transposed) {
      T* to = tape.scratch(detail::transposed_size<T>(in, out));
      detail::pack_transposed(w.value(), in, out, to);
      transposed = to;
    }
    detail::product<T>({.m = n,
                        .n = in,
                        .k = detail::transposed_rows<T>(out) / panels,
                        .segments = panels,
                        .a = d,
                        .a_row = panel,
                        .a_segment = n * panel,
                        .b = transposed,
                        .c = dx,
                        .ldc = in,
                        .accumulate = !fresh});
  }
}

}  // namespace

template <class T>
Var<T> dense(Var<T> x, Var<T> w, Var<T> b, Activation activation) {
  check_rank("dense", "x", x.shape(), 2, "[N, in]");
  check_rank("dense", "w", w.shape(), 2, "[in, out]");
  check_rank("dense", "b", b.shape(), 1, "[out]");
  const Index n = x.shape()[0], in = x.shape()[1], out = w.shape()[1];
  check_extent("dense", "w", w.shape(), 0, in, "the columns of x, whose shape is " + x.shape().str());
  check_extent("dense", "b", b.shape(), 0, out, "the columns of w, whose shape is " + w.shape().str());
  const bool relu = activation == Activation::relu;
  Tape<T>& tape = x.tape();
  T* y = nullptr;
  const Var<T> result = tape.output({n, out}, &y, {x, w, b});
  detail::product<T>(
      {.m = n,
       .n = out,
       .k = in,
       .a = x.value(),
       .a_row = in,
       .b = w.packed() ? w.packed()->forward : detail::packed(tape, w.value(), in, out, out, Index{1}),
       .c = y,
       .ldc = out,
       .bias = b.value(),
       .relu = relu});

  // dZ = dY where y > 0 (all of it without a ReLU); dX = dZ W^T, dW = X^T dZ, db = column sums of dZ.
  tape.on_backward(result, [=](const T* dy) { backward(x, w, b, y, dy, n, relu); });
  return result;
}

template Var<float> dense(Var<float>, Var<float>, Var<float>, Activation);
template Var<double> dense(Var<double>, Var<double>, Var<double>, Activation);

}  // namespace fieldmark
