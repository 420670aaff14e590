#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/engine/shape_checks.h>

#include <array>
#include <memory>

#include "ops/axes.h"

namespace fieldmark {
namespace {

void check_has_axis(const char* op, const Shape& s) {
  if (s.rank() == 0)
    throw ShapeError(std::string("[") + op + "] x must have rank 1 or more [.., C], got shape []");
}

// Returns "the last axis", or "axis 0" and so on for any other.
std::string axis_words(const Shape& s, int axis) {
  return axis == s.rank() - 1 ? "the last axis" : "axis " + std::to_string(axis);
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
  if (!xs.empty()) check_has_axis("concatenate", xs[0].shape());
  return concatenate(xs, -1);
}

template <class T>
Var<T> concatenate(std::span<const Var<T>> xs, int axis) {
  if (xs.empty()) throw ValueError("[concatenate] xs must have at least one tensor, got 0");
  const Shape first = xs[0].shape();
  axis = check_axis("concatenate", "axis", axis, first);
  Index joined = 0;
  for (const Var<T>& x : xs) {
    if (x.shape().rank() != first.rank() ||
        detail::with_extent(x.shape(), axis, 0) != detail::with_extent(first, axis, 0))
      throw ShapeError("[concatenate] xs: all axes but " +
                       (axis == first.rank() - 1 ? std::string("the last") : "axis " + std::to_string(axis)) +
                       " must be those of the first, " + first.str() + ", got shape " + x.shape().str());
    joined += x.shape()[axis];
  }
  const detail::Split p = detail::split(first, axis);
  const Index rows = p.outer, inner = p.inner, width = joined * inner, count = static_cast<Index>(xs.size());
  Tape<T>& tape = xs[0].tape();
  T* y = nullptr;
  const Var<T> out = tape.output(detail::with_extent(first, axis, joined), &y, xs);
  auto* kept = tape.template scratch<Var<T>>(count);
  std::uninitialized_copy(xs.begin(), xs.end(), kept);
  parallel_for(rows, detail::row_grain(width), [&](Index r0, Index r1) {
    for (Index r = r0; r < r1; ++r) {
      T* to = y + r * width;
      for (Index k = 0; k < count; ++k) {
        const Index c = kept[k].shape()[axis] * inner;
        to = std::copy_n(kept[k].value() + r * c, c, to);
      }
    }
  });

  // Each input receives the gradient of its columns.
  tape.on_backward(out, [kept, count, rows, width, axis, inner](const T* dy) {
    Index begin = 0;
    for (Index k = 0; k < count; ++k) {
      const Index c = kept[k].shape()[axis] * inner;
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
  return slice(x, -1, begin, count);
}

template <class T>
Var<T> slice(Var<T> x, int axis, Index begin, Index count) {
  axis = check_axis("slice", "axis", axis, x.shape());
  if (begin < 0 || count < 0 || begin > x.shape()[axis] - count)
    throw ShapeError("[slice] begin and count: entries " + std::to_string(begin) + " to " +
                     std::to_string(begin + count) + " must lie within " + axis_words(x.shape(), axis) +
                     " of x, got shape " + x.shape().str());
  const detail::Split p = detail::split(x.shape(), axis);
  const Index rows = p.outer;
  const Columns s{begin * p.inner, count * p.inner, p.n * p.inner};
  T* y = nullptr;
  const Var<T> out = x.tape().output(detail::with_extent(x.shape(), axis, count), &y, {x});
  add_columns(rows, s, x.value(), y, true);

  // The other columns receive nothing. A chunk owns its rows.
  x.tape().on_backward(out, [x, rows, s](const T* dy) {
    T* dx = x.grad_acc();
    parallel_for(rows, detail::row_grain(s.count), [&](Index r0, Index r1) {
      for (Index r = r0; r < r1; ++r)
        for (Index c = 0; c < s.count; ++c) dx[r * s.width + s.begin + c] += dy[r * s.count + c];
    });
  });
  return out;
}

#define FIELDMARK_SLICE(T)                                   \
  template Var<T> concatenate(std::span<const Var<T>>);      \
  template Var<T> concatenate(std::span<const Var<T>>, int); \
  template Var<T> slice(Var<T>, Index, Index);               \
  template Var<T> slice(Var<T>, int, Index, Index);
FIELDMARK_SLICE(float)
FIELDMARK_SLICE(double)
#undef FIELDMARK_SLICE

}  // namespace fieldmark
