#include <fieldmark/engine/ops/dense.h>
#include <fieldmark/engine/shape_checks.h>

#include "ops/product.h"
#include "shortcuts.h"

namespace fieldmark {
namespace {

constexpr Index kShardRows = 4096;  // rows per partial sum of the weight gradient
constexpr Index kChunkRows = 512;   // rows that the backward processes together: they stay in L2
constexpr Index kWeightRows = 24;   // rows of the weight gradient per chunk: whole register blocks

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

// dW[first, first + count) += X^T dZ over rows from `begin` on. d holds their dZ in rows of whole vectors.
template <class T>
void add_weight_rows(const Backward<T>& p, const T* d, Index begin, Index rows, Index first, Index count,
                     T* dw) {
  using namespace kernels;
  FIELDMARK_KERNEL(gemm<T>)
  ({.m = count,
    .n = p.out,
    .k = rows,
    .a = p.x + begin * p.in + first,
    .a_row = 1,
    .a_col = p.in,
    .b = d,
    .b_row = detail::whole_row<T>(p.out),
    .b_panel = detail::panel_width<T>(p.out),
    .c = dw + first * p.out,
    .ldc = p.out,
    .accumulate = true});
}

// dX = or += dZ W^T for rows from `begin` on.
template <class T>
void put_input_rows(const Backward<T>& p, const T* d, Index begin, Index rows) {
  using namespace kernels;
  const Index row = detail::whole_row<T>(p.out);
  const T* mask = p.mask_dx ? p.x + begin * p.in : nullptr;
  if constexpr (std::is_same_v<T, float>)
    if (p.transposed_bf16)
      return detail::product(GemmBf16{.m = rows,
                                      .n = p.in,
                                      .k = p.out,
                                      .a = d,
                                      .a_row = row,
                                      .b = p.transposed_bf16,
                                      .c = p.dx + begin * p.in,
                                      .ldc = p.in,
                                      .mask = mask,
                                      .accumulate = !p.fresh});
  FIELDMARK_KERNEL(gemm<T>)
  ({.m = rows,
    .n = p.in,
    .k = p.out,
    .a = d,
    .a_row = row,
    .b = p.transposed,
    .c = p.dx + begin * p.in,
    .ldc = p.in,
    .mask = mask,
    .accumulate = !p.fresh});
}

// Returns dZ of rows [begin, end) in rows of whole vectors: in `buffer`, or dY itself if `buffer` is null.
template <class T>
const T* masked_rows(const Backward<T>& p, const T* dy, Index begin, Index end, T* buffer) {
  using namespace kernels;
  const Index at = begin * p.out;
  if (!buffer) return dy + at;
  FIELDMARK_KERNEL(pad_rows<T>)
  (dy + at, end - begin, p.out, p.mask ? p.mask + at : nullptr, detail::whole_row<T>(p.out), buffer);
  return buffer;
}

// Backward of rows [begin, end): adds their share of dW and db and writes their dX.
template <class T>
void backward_rows(const Backward<T>& p, const T* dy, Index begin, Index end, T* buffer, T* dw, T* db) {
  const T* d = masked_rows(p, dy, begin, end, buffer);
  if (dw) add_weight_rows(p, d, begin, end - begin, 0, p.in, dw);
  if (db) detail::add_column_sums(d, end - begin, p.out, db);
  if (p.dx) put_input_rows(p, d, begin, end - begin);
}

// Backward of several chunks of rows, too few for shards, on several threads: a thread owns rows of dZ and
// dX, then rows of dW. Each element is summed in the order of backward_rows(), which keeps a chunk in cache
// when one thread does all the work. @param buffer  for all rows, or null
template <class T>
void backward_of_few(const Backward<T>& p, const T* dy, Index n, T* buffer, T* dw, T* db) {
  const Index row = detail::whole_row<T>(p.out);
  parallel_for(n, detail::product_rows(n, p.in, p.out), [&](Index begin, Index end) {
    const T* d = masked_rows(p, dy, begin, end, buffer ? buffer + begin * row : nullptr);
    if (p.dx) put_input_rows(p, d, begin, end - begin);
  });
  const T* d = buffer ? buffer : dy;
  const auto for_chunks = [&](auto f) {
    for (Index i = 0; i < n; i += kChunkRows) f(d + i * row, i, std::min(kChunkRows, n - i));
  };
  if (dw)
    parallel_for(p.in, kWeightRows, [&](Index begin, Index end) {
      for_chunks([&](const T* rows, Index first, Index count) {
        add_weight_rows(p, rows, first, count, begin, end - begin, dw);
      });
    });
  if (db)
    for_chunks([&](const T* rows, Index, Index count) { detail::add_column_sums(rows, count, p.out, db); });
}

// Chunks own their rows of dX; the sums for dW and db are kept per shard of whole chunks and added in order.
template <class T>
void add_gradients(Tape<T>& tape, const Backward<T>& p, Index n, const T* dy, T* dw, T* db) {
  const Index in = p.in, out = p.out, row = detail::whole_row<T>(out);
  const Index chunks = (n + kChunkRows - 1) / kChunkRows, own = (dw ? in * out : 0) + (db ? out : 0);
  const Index shards = std::min(detail::kProductShards, (n + kShardRows - 1) / kShardRows);
  const bool copies = p.mask || row != out;
  if (shards == 1 && chunks > 1 && !detail::runs_on_one_thread())
    return backward_of_few(p, dy, n, copies ? tape.scratch(n * row) : nullptr, dw, db);
  const Index buffer = copies ? std::min(n, kChunkRows) * row : 0;
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

template <class T>
void backward(Var<T> x, Var<T> w, Var<T> b, bool relu, Var<T> y, const T* dy) {
  using Shortcuts = detail::Shortcuts<T>;
  Tape<T>& tape = x.tape();
  const Index n = x.shape()[0], in = w.shape()[0], out = w.shape()[1];
  const PackedMatrix<T>* packed = Shortcuts::packed(w);
  const T* mask = relu && !(Shortcuts::rectified(y) && Shortcuts::grad_masked(y)) ? y.value() : nullptr;
  Backward<T> p{in, out, x.value(), nullptr, mask, nullptr, nullptr, Shortcuts::rectified(x), false};
  if (packed) p.transposed_bf16 = packed->transposed_bf16;
  // First the sums: if x is w too, the buffer of both is then zeroed, not fresh.
  T *dw = w.grad_acc(), *db = b.grad_acc();
  p.dx = Shortcuts::grad_acc(x, &p.fresh, p.mask_dx);
  if (p.dx)
    p.transposed = packed ? packed->transposed : detail::packed(tape, w.value(), out, in, Index{1}, out);
  if (!dw || dw != p.dx) return add_gradients(tape, p, n, dy, dw, db);
  // x is w: dX is added before dW, in whatever order the threads compute them.
  T* of_w = tape.scratch(in * out);
  std::fill_n(of_w, in * out, T(0));
  add_gradients(tape, p, n, dy, of_w, db);
  for (Index i = 0; i < in * out; ++i) dw[i] += of_w[i];
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
