#include <fieldmark/engine/ops/batched_matmul.h>
#include <fieldmark/engine/ops/layout.h>
#include <fieldmark/engine/ops/matmul.h>
#include <fieldmark/engine/shape_checks.h>

#include "ops/broadcast.h"
#include "ops/product.h"

namespace fieldmark {
namespace {

void check_matrices(const char* arg, const Shape& s, const char* layout) {
  if (s.rank() < 2)
    throw ShapeError(std::string("[batched_matmul] ") + arg + " must have rank 2 or more " + layout +
                     ", got shape " + s.str());
}

Shape batch_of(const Shape& s) {
  std::array<Index, Shape::kMaxRank> extents{};
  for (int k = 0; k + 2 < s.rank(); ++k) extents[at(k)] = s[k];
  return Shape(std::span(extents).first(at(s.rank() - 2)));
}

Shape with_matrices(const Shape& batch, Index rows, Index columns) {
  std::array<Index, Shape::kMaxRank> extents{};
  for (int k = 0; k < batch.rank(); ++k) extents[at(k)] = batch[k];
  extents[at(batch.rank())] = rows;
  extents[at(batch.rank() + 1)] = columns;
  return Shape(std::span(extents).first(at(batch.rank() + 2)));
}

// The matrices of one operand in sequence, each read at data[i row + j column].
template <class T>
struct Side {
  const T* data;
  Index row, column;
};

// c[p] = or += a[p] b[p] for matrices a [m, k] and b [k, n]. A thread owns a matrix of c.
template <class T>
void products(Tape<T>& tape, Index count, Index m, Index n, Index k, Side<T> a, Side<T> b, T* c,
              bool assign) {
  const Index panels = detail::panels_size<T>(k, n);
  T* packed = tape.scratch(count * panels);
  constexpr Index kWork = Index{1} << 18;  // multiplications per chunk, enough to outweigh waking a thread
  parallel_for(count, kWork / std::max<Index>(1, m * n * k), [&](Index p0, Index p1) {
    for (Index p = p0; p < p1; ++p) {
      detail::pack<T>(b.data + p * k * n, k, n, b.row, b.column, nullptr, packed + p * panels);
      detail::product<T>({.m = m,
                          .n = n,
                          .k = k,
                          .a = a.data + p * m * k,
                          .a_row = a.row,
                          .a_col = a.column,
                          .b = packed + p * panels,
                          .c = c + p * m * n,
                          .ldc = n,
                          .accumulate = !assign});
    }
  });
}

}  // namespace

template <class T>
Var<T> batched_matmul(Var<T> a, Var<T> b) {
  check_matrices("a", a.shape(), "[.., m, k]");
  check_matrices("b", b.shape(), "[.., k, n]");
  const Index m = a.shape()[-2], k = a.shape()[-1], n = b.shape()[-1];
  check_extent("batched_matmul", "b", b.shape(), b.shape().rank() - 2, k, "the columns of a", a.shape());
  const Shape batch =
      detail::Broadcast("batched_matmul: batch axes", batch_of(a.shape()), batch_of(b.shape())).shape;
  const Index count = batch.size();
  if (b.shape().rank() == 2)
    return reshape(matmul(reshape(a, {count * m, k}), b), with_matrices(batch, m, n));
  a = broadcast_to(a, with_matrices(batch, m, k));
  b = broadcast_to(b, with_matrices(batch, k, n));
  Tape<T>& tape = a.tape();
  T* y = nullptr;
  const Var<T> out = tape.output(with_matrices(batch, m, n), &y, {a, b});
  products<T>(tape, count, m, n, k, {a.value(), k, 1}, {b.value(), n, 1}, y, true);

  // dA = dY B^T, dB = A^T dY.
  tape.on_backward(out, [a, b, count, m, n, k](const T* dy) {
    bool fresh = false;
    if (T* da = a.grad_acc(&fresh))
      products<T>(a.tape(), count, m, k, n, {dy, n, 1}, {b.value(), 1, n}, da, fresh);
    if (T* db = b.grad_acc(&fresh))
      products<T>(a.tape(), count, k, n, m, {a.value(), 1, k}, {dy, n, 1}, db, fresh);
  });
  return out;
}

template Var<float> batched_matmul(Var<float>, Var<float>);
template Var<double> batched_matmul(Var<double>, Var<double>);

}  // namespace fieldmark
