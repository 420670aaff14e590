#include <fieldmark/engine/ops/slice.h>

#include <array>
#include <memory>

#include "ops/chunks.h"

namespace fieldmark {
namespace {

// Product of all extents but the last.
Index leading(const Shape& s) {
  Index n = 1;
  for (int k = 0; k + 1 < s.rank(); ++k) n *= s[k];
  return n;
}

Shape with_last(const Shape& s, Index last) {
  std::array<Index, Shape::kMaxRank> extents{};
  const auto rank = static_cast<std::size_t>(s.rank());
  for (std::size_t k = 0; k + 1 < rank; ++k) extents[k] = s[static_cast<int>(k)];
  extents[rank - 1] = last;
  return Shape(std::span(extents).first(rank));
}

void check_has_axis(const char* op, const Shape& s) {
  if (s.rank() == 0)
    throw ShapeError(std::string("[") + op + "] x must have rank 1 or more [.., C], got shape []");
}

// Columns [begin, begin + count) of a row-major matrix with `width` columns.
struct Columns {
  Index begin, count, width;
};

// Adds the columns of dy to (or, if fresh, assigns) the narrow dx. A chunk owns its rows.
template <class T>
void add_columns(Index rows, Columns s, const T* dy, T* dx, bool fresh) {
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
Var<T> concatenate(std::span<const Var<T>> xs) {
  if (xs.empty()) throw ValueError("[concatenate] xs must have at least one tensor, got 0");
  Index width = 0;
  const Shape first = xs[0].shape();
  for (const Var<T>& x : xs) {
    check_has_axis("concatenate", x.shape());
    if (with_last(x.shape(), 0) != with_last(first, 0))
      throw ShapeError("[concatenate] xs: all axes but the last must be those of the first, " + first.str() +
                       ", got shape " + x.shape().str());
    width += x.shape()[-1];
  }
  const Index rows = leading(first), count = static_cast<Index>(xs.size());
  Tape<T>& tape = xs[0].tape();
  T* y = nullptr;
  const Var<T> out = tape.output(with_last(first, width), &y, xs);
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

  // Each input receives the gradient of its columns.
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
Var<T> slice(Var<T> x, Index begin, Index count) {
  check_has_axis("slice", x.shape());
  const Index rows = leading(x.shape()), width = x.shape()[-1];
  if (begin < 0 || count < 0 || begin > width - count)
    throw ShapeError("[slice] begin and count: entries " + std::to_string(begin) + " to " +
                     std::to_string(begin + count) + " must lie within the last axis of x, got shape " +
                     x.shape().str());
  T* y = nullptr;
  const Var<T> out = x.tape().output(with_last(x.shape(), count), &y, {x});
  add_columns(rows, {begin, count, width}, x.value(), y, true);

  // The other columns receive nothing. A chunk owns its rows.
  x.tape().on_backward(out, [x, rows, begin, count, width](const T* dy) {
    T* dx = x.grad_acc();
    parallel_for(rows, detail::row_grain(count), [&](Index r0, Index r1) {
      for (Index r = r0; r < r1; ++r)
        for (Index c = 0; c < count; ++c) dx[r * width + begin + c] += dy[r * count + c];
    });
  });
  return out;
}

template Var<float> concatenate(std::span<const Var<float>>);
template Var<double> concatenate(std::span<const Var<double>>);
template Var<float> slice(Var<float>, Index, Index);
template Var<double> slice(Var<double>, Index, Index);

}  // namespace fieldmark
