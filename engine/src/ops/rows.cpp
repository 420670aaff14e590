#include <fieldmark/engine/ops/rows.h>
#include <fieldmark/engine/shape_checks.h>

#include "ops/indexed.h"

namespace fieldmark {
namespace {

// One column sum per chunk of rows; chunks are added in order, with the same bits for any thread count.
template <class T>
void add_column_sums(Tape<T>& tape, const T* dy, Index rows, Index cols, T* dx) {
  const Index grain = detail::row_grain(cols), chunks = (rows + grain - 1) / grain;
  auto* partial = tape.template scratch<double>(chunks * cols);
  parallel_for(rows, grain, [&](Index r0, Index r1) {
    double* sum = partial + r0 / grain * cols;
    std::fill_n(sum, cols, 0.0);
    for (Index r = r0; r < r1; ++r)
      for (Index c = 0; c < cols; ++c) sum[c] += static_cast<double>(dy[r * cols + c]);
  });
  for (Index c = 0; c < cols; ++c) dx[c] += static_cast<T>(detail::channel_total(partial, chunks, cols, c));
}

}  // namespace

template <class T>
Var<T> broadcast_rows(Var<T> x, Index rows) {
  const Shape s = x.shape();
  if (!(s.rank() == 1 || (s.rank() == 2 && s[0] == 1)))
    throw ShapeError("[broadcast_rows] x must be one row, [1, C] or [C], got shape " + s.str());
  if (rows < 0) throw ShapeError("[broadcast_rows] rows must be 0 or more, got " + std::to_string(rows));
  const Index cols = s[-1];
  T* y = nullptr;
  const Var<T> out = x.tape().output({rows, cols}, &y, {x});
  parallel_for(rows, detail::row_grain(cols), [&](Index r0, Index r1) {
    for (Index r = r0; r < r1; ++r) std::copy_n(x.value(), cols, y + r * cols);
  });

  // dx[c] = sum_r dy[r, c].
  x.tape().on_backward(
      out, [x, rows, cols](const T* dy) { add_column_sums(x.tape(), dy, rows, cols, x.grad_acc()); });
  return out;
}

template <class T>
Var<T> gather_rows(Var<T> x, std::span<const std::int32_t> index) {
  check_rank("gather_rows", "x", x.shape(), 2, "[rows, cols]");
  return detail::gather("gather_rows", x, 0, index, "the rows of x");
}

template Var<float> broadcast_rows(Var<float>, Index);
template Var<double> broadcast_rows(Var<double>, Index);
template Var<float> gather_rows(Var<float>, std::span<const std::int32_t>);
template Var<double> gather_rows(Var<double>, std::span<const std::int32_t>);

}  // namespace fieldmark
