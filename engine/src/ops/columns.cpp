#include <fieldmark/engine/ops/columns.h>

#include <memory>

#include "ops/pieces.h"

namespace fieldmark {
namespace {

// Product of all extents but the last.
Index leading(const Shape& s) {
  Index n = 1;
  for (int k = 0; k + 1 < s.rank(); ++k) n *= s[k];
  return n;
}

Shape with_last(const Shape& s, Index last) {
  switch (s.rank()) {
    case 1:
      return {last};
    case 2:
      return {s[0], last};
    case 3:
      return {s[0], s[1], last};
    case 4:
      return {s[0], s[1], s[2], last};
    default:
      return {s[0], s[1], s[2], s[3], last};
  }
}

void check_has_columns(const char* op, const Shape& s) {
  if (s.rank() == 0)
    throw ShapeError(std::string("[") + op + "] x must have rank 1 or more [.., C], got shape []");
}

// Columns of a wide row-major matrix: where they start, how many, and the matrix's own.
struct Slice {
  Index begin, count, width;
};

// Adds the columns of dy to (or, if fresh, assigns) the narrow dx. A row is owned by one piece.
template <class T>
void add_columns(Index rows, Slice s, const T* dy, T* dx, bool fresh) {
  parallel_for(rows, detail::row_grain(s.count), [&](Index r0, Index r1) {
    for (Index r = r0; r < r1; ++r) {
      const T* from = dy + r * s.width + s.begin;
      T* to = dx + r * s.count;
      if (fresh)
        std::copy_n(from, s.count, to);
      else
        for (Index c = 0; c < s.count; ++c) to[c] += from[c];
    }
  });
}

}  // namespace

template <class T>
Var<T> concat_columns(std::span<const Var<T>> xs) {
  if (xs.empty()) throw ValueError("[concat_columns] xs must have at least one tensor, got 0");
  Index width = 0;
  bool needs_grad = false;
  const Shape first = xs[0].shape();
  for (const Var<T>& x : xs) {
    check_has_columns("concat_columns", x.shape());
    if (with_last(x.shape(), 0) != with_last(first, 0))
      throw ShapeError("[concat_columns] xs: all axes but the last must be those of the first, " +
                       first.str() + ", got shape " + x.shape().str());
    width += x.shape()[-1];
    needs_grad = needs_grad || x.needs_grad();
  }
  const Index rows = leading(first), count = static_cast<Index>(xs.size());
  Tape<T>& tape = xs[0].tape();
  T* y = nullptr;
  const Var<T> out = tape.output(with_last(first, width), &y, needs_grad);
  auto* kept = tape.template scratch<Var<T>>(count);
  std::uninitialized_copy(xs.begin(), xs.end(), kept);
  parallel_for(rows, detail::row_grain(width), [&](Index r0, Index r1) {
    for (Index r = r0; r < r1; ++r) {
      T* to = y + r * width;
      for (Index k = 0; k < count; ++k) {
        const Index c = kept[k].shape()[-1];
        to = std::copy_n(kept[k].value() + r * c, c, to);
      }
    }
  });

  // Each input receives the gradient of its own columns.
  tape.on_backward(out, [kept, count, rows, width](const T* dy) {
    Index begin = 0;
    for (Index k = 0; k < count; ++k) {
      const Index c = kept[k].shape()[-1];
      bool fresh = false;
      if (T* dx = kept[k].grad_acc(&fresh)) add_columns(rows, {begin, c, width}, dy, dx, fresh);
      begin += c;
    }
  });
  return out;
}

template <class T>
Var<T> columns(Var<T> x, Index begin, Index count) {
  check_has_columns("columns", x.shape());
  const Index rows = leading(x.shape()), width = x.shape()[-1];
  if (begin < 0 || count < 0 || begin > width - count)
    throw ShapeError("[columns] begin and count: columns " + std::to_string(begin) + " to " +
                     std::to_string(begin + count) + " must lie within those of x, got shape " +
                     x.shape().str());
  T* y = nullptr;
  const Var<T> out = x.tape().output(with_last(x.shape(), count), &y, {x});
  add_columns(rows, {begin, count, width}, x.value(), y, true);

  // The other columns receive nothing. A row is owned by one piece.
  x.tape().on_backward(out, [x, rows, begin, count, width](const T* dy) {
    T* dx = x.grad_acc();
    parallel_for(rows, detail::row_grain(count), [&](Index r0, Index r1) {
      for (Index r = r0; r < r1; ++r)
        for (Index c = 0; c < count; ++c) dx[r * width + begin + c] += dy[r * count + c];
    });
  });
  return out;
}

template Var<float> concat_columns(std::span<const Var<float>>);
template Var<double> concat_columns(std::span<const Var<double>>);
template Var<float> columns(Var<float>, Index, Index);
template Var<double> columns(Var<double>, Index, Index);

}  // namespace fieldmark
