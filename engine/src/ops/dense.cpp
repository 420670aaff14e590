#include <fieldmark/engine/ops/dense.h>
#include <fieldmark/engine/shape_checks.h>

#include "ops/product.h"
#include "shortcuts.h"

namespace fieldmark {
namespace {

constexpr Index kShardRows = 4096;  // rows of a partial sum of the weights' gradient
constexpr Index kChunkRows = 512;   // rows that pass through the backward together: they stay in L2

template <class T>
void forward(Var<T> x, Var<T> w, Var<T> b, bool relu, T* y) {
  const Index n = x.shape()[0], in = w.shape()[0], out = w.shape()[1];
  const PackedMatrix<T>* packed = detail::Shortcuts<T>::packed(w);
  if constexpr (std::is_same_v<T, float>)
    if (packed && packed->forward_bf16)
      return detail::product(kernels::GemmBf16{.m = n,
                                               .n = out,
                                               .k = in,
                                               .a = x.value(),
                                               .a_row = in,
                                               .b = packed->forward_bf16,
                                               .c = y,
                                               .ldc = out,
                                               .bias = b.value(),
                                               .relu = relu});
  detail::product<T>(
      {.m = n,
       .n = out,
       .k = in,
       .a = x.value(),
       .a_row = in,
       .b = packed ? packed->forward : detail::packed(x.tape(), w.value(), in, out, out, Index{1}),
       .c = y,
       .ldc = out,
       .bias = b.value(),
       .relu = relu});
}

template <class T>
struct Backward {
  Index in, out;
  const T *x, *transposed, *mask;  // mask: the ReLU's output if dY is not masked yet, else null
  const std::uint16_t* transposed_bf16;
  T* dx;  // null: not wanted
  bool mask_dx, fresh;
};

// Rows [begin, end): their share of dW and db, and their dX. `buffer` holds dZ in rows of whole vectors; null
// if dY is dZ in that layout.
template <class T>
void backward_rows(const Backward<T>& p, const T* dy, Index begin, Index end, T* buffer, T* dw, T* db) {
  using namespace kernels;
  const auto product = FIELDMARK_KERNEL(gemm<T>);
  const Index rows = end - begin, at = begin * p.out, row = detail::whole_row<T>(p.out);
  const T *d = dy + at, *x = p.x + begin * p.in;
  if (buffer) {
    FIELDMARK_KERNEL(pad_rows<T>)(d, rows, p.out, p.mask ? p.mask + at : nullptr, row, buffer);
    d = buffer;
  }
  if (dw)
    product({.m = p.in,
             .n = p.out,
             .k = rows,
             .a = x,
             .a_row = 1,
             .a_col = p.in,
             .b = d,
             .b_row = row,
             .b_panel = detail::panel_width<T>(p.out),
             .c = dw,
             .ldc = p.out,
             .accumulate = true});
  if (db) detail::add_column_sums(d, rows, p.out, db);
  if constexpr (std::is_same_v<T, float>)
    if (p.dx && p.transposed_bf16)
      return detail::product(kernels::GemmBf16{.m = rows,
                                               .n = p.in,
                                               .k = p.out,
                                               .a = d,
                                               .a_row = row,
                                               .b = p.transposed_bf16,
                                               .c = p.dx + begin * p.in,
                                               .ldc = p.in,
                                               .mask = p.mask_dx ? x : nullptr,
                                               .accumulate = !p.fresh});
  if (p.dx)
    product({.m = rows,
             .n = p.in,
             .k = p.out,
             .a = d,
             .a_row = row,
             .b = p.transposed,
             .c = p.dx + begin * p.in,
             .ldc = p.in,
             .mask = p.mask_dx ? x : nullptr,
             .accumulate = !p.fresh});
}

// Chunks own their rows of dX; the sums for dW and db are kept per shard of whole chunks and added in order.
template <class T>
void backward(Var<T> x, Var<T> w, Var<T> b, bool relu, Var<T> y, const T* dy) {
  using Shortcuts = detail::Shortcuts<T>;
  Tape<T>& tape = x.tape();
  const Index n = x.shape()[0], in = w.shape()[0], out = w.shape()[1], row = detail::whole_row<T>(out);
  const PackedMatrix<T>* packed = Shortcuts::packed(w);
  const T* mask = relu && !(Shortcuts::rectified(y) && Shortcuts::grad_masked(y)) ? y.value() : nullptr;
  Backward<T> p{in, out, x.value(), nullptr, mask, nullptr, nullptr, Shortcuts::rectified(x), false};
  if (packed) p.transposed_bf16 = packed->transposed_bf16;
  p.dx = Shortcuts::grad_acc(x, &p.fresh, p.mask_dx);
  if (p.dx)
    p.transposed = packed ? packed->transposed : detail::packed(tape, w.value(), out, in, Index{1}, out);
  T *dw = w.grad_acc(), *db = b.grad_acc();
  const Index chunks = (n + kChunkRows - 1) / kChunkRows, own = (dw ? in * out : 0) + (db ? out : 0);
  const Index shards = std::min(detail::kProductShards, (n + kShardRows - 1) / kShardRows);
  const Index buffer = mask || row != out ? std::min(n, kChunkRows) * row : 0;
  T *buffers = tape.scratch(shards * buffer), *sums = shards > 1 ? tape.scratch(shards * own) : nullptr;
  parallel_for(shards, 1, [&](Index s, Index) {
    T *to_w = dw, *to_b = db;
    if (sums) {
      to_w = dw ? sums + s * own : nullptr;
      to_b = db ? sums + (s + 1) * own - out : nullptr;
      std::fill_n(sums + s * own, own, T(0));
    }
    for (Index i = s * chunks / shards; i < (s + 1) * chunks / shards; ++i)
      backward_rows(p, dy, i * kChunkRows, std::min(n, (i + 1) * kChunkRows),
                    buffer ? buffers + s * buffer : nullptr, to_w, to_b);
  });
  for (Index s = 0; sums && s < shards; ++s) {
    const T* from = sums + s * own;
    for (Index i = 0; dw && i < in * out; ++i) dw[i] += from[i];
    for (Index i = 0; db && i < out; ++i) db[i] += from[own - out + i];
  }
}

}  // namespace

template <class T>
Var<T> dense(Var<T> x, Var<T> w, Var<T> b, Activation activation) {
  check_rank("dense", "x", x.shape(), 2, "[N, in]");
  check_rank("dense", "w", w.shape(), 2, "[in, out]");
  check_rank("dense", "b", b.shape(), 1, "[out]");
  const Index n = x.shape()[0], in = x.shape()[1], out = w.shape()[1];
  check_extent("dense", "w", w.shape(), 0, in, "the columns of x", x.shape());
  check_extent("dense", "b", b.shape(), 0, out, "the columns of w", w.shape());
  const bool relu = activation == Activation::relu;
  Tape<T>& tape = x.tape();
  T* y = nullptr;
  const Var<T> result = tape.output({n, out}, &y, {x, w, b});
  forward(x, w, b, relu, y);
  if (relu) detail::Shortcuts<T>::mark_rectified(result);

  // dZ = dY where y > 0 (everywhere without a ReLU); dX = dZ W^T, dW = X^T dZ, db = column sums of dZ. If x
  // is the output of a ReLU, its mask is applied to dX here, while x is in cache.
  tape.on_backward(result, [=](const T* dy) { backward(x, w, b, relu, result, dy); });
  return result;
}

template Var<float> dense(Var<float>, Var<float>, Var<float>, Activation);
template Var<double> dense(Var<double>, Var<double>, Var<double>, Activation);

}  // namespace fieldmark
