#include <fieldmark/engine/ops/layout.h>
#include <fieldmark/engine/shape_checks.h>

#include <algorithm>
#include <numeric>

#include "ops/broadcast.h"
#include "ops/window_checks.h"

namespace fieldmark {
namespace {

// Where the elements of a permuted tensor lie in the original, for each row along its last axis.
struct Permutation {
  Shape shape;                                  // of y
  std::array<Index, Shape::kMaxRank> stride{};  // in x, of each axis of y

  Permutation(const Shape& s, std::span<const int> order) {
    if (static_cast<int>(order.size()) != s.rank())
      throw ShapeError("[permute] order must have the " + std::to_string(s.rank()) +
                       " axes of x, whose shape is " + s.str() + ", got " + std::to_string(order.size()));
    std::array<Index, Shape::kMaxRank> extents{};
    std::array<bool, Shape::kMaxRank> seen{};
    for (std::size_t k = 0; k < order.size(); ++k) {
      const int axis = check_axis("permute", "order", order[k], s);
      if (std::exchange(seen[at(axis)], true))
        throw ValueError("[permute] order: axis " + std::to_string(axis) +
                         " must be named once, got it twice");
      extents[k] = s[axis];
      stride[k] = detail::split(s, axis).inner;
    }
    shape = Shape(std::span(extents).first(order.size()));
  }

  // Calls f(first element in y, first in x, step in x, count) for parts of rows, in parallel. Parts of a few
  // cache lines of x are taken from one row after another: the next row often needs the same lines.
  template <class F>
  void for_rows(F f) const {
    const int last = shape.rank() - 1;
    const Index inner = last < 0 ? 1 : shape[last], step = last < 0 ? 1 : stride[at(last)];
    if (shape.size() == 0) return;
    const Index part = step == 1 ? inner : std::min<Index>(inner, 64);
    parallel_for(shape.size() / inner, detail::row_grain(inner), [&](Index r0, Index r1) {
      for (Index i = 0; i < inner; i += part)
        for (Index r = r0; r < r1; ++r)
          f(r * inner + i, first_of(r) + i * step, step, std::min(part, inner - i));
    });
  }

  // Returns the place in x of row r's first element.
  Index first_of(Index r) const {
    Index from = 0;
    for (int k = shape.rank() - 2; k >= 0; --k) {
      from += r % shape[k] * stride[at(k)];
      r /= shape[k];
    }
    return from;
  }
};

// Returns the extent of the padded axis.
Index padded_extent(const Shape& s, int axis, Index before, Index after) {
  Index extent = 0;
  bool fits =
      !__builtin_add_overflow(s[axis], before, &extent) && !__builtin_add_overflow(extent, after, &extent);
  if (fits) {
    const detail::Split p = detail::split(s, axis);
    fits = detail::is_countable({p.outer, extent, p.inner});
  }
  if (!fits)
    throw ValueError("[pad] before and after must leave fewer than 2^60 elements of the result, got " +
                     std::to_string(before) + " and " + std::to_string(after) + " for shape " + s.str());
  return extent;
}

}  // namespace

template <class T>
Var<T> reshape(Var<T> x, Shape shape) {
  return x.tape().reshape(x, shape);
}

template <class T>
Var<T> permute(Var<T> x, std::span<const int> order) {
  const Permutation p(x.shape(), order);
  T* y = nullptr;
  const Var<T> out = x.tape().output(p.shape, &y, {x});
  const T* from = x.value();
  p.for_rows([=](Index to, Index at, Index step, Index n) {
    for (Index i = 0; i < n; ++i) y[to + i] = from[at + i * step];
  });

  // Each element of dx is one of dy.
  x.tape().on_backward(out, [x, p](const T* dy) {
    bool fresh = false;
    T* dx = x.grad_acc(&fresh);
    p.for_rows([=](Index to, Index at, Index step, Index n) {
      for (Index i = 0; i < n; ++i) dx[at + i * step] = fresh ? dy[to + i] : dx[at + i * step] + dy[to + i];
    });
  });
  return out;
}

template <class T>
Var<T> transpose(Var<T> x, int a, int b) {
  std::array<int, Shape::kMaxRank> order{};
  std::iota(order.begin(), order.end(), 0);
  std::swap(order[at(check_axis("transpose", "a", a, x.shape()))],
            order[at(check_axis("transpose", "b", b, x.shape()))]);
  return permute(x, std::span<const int>(order).first(at(x.shape().rank())));
}

template <class T>
Var<T> broadcast_to(Var<T> x, Shape shape) {
  if (x.shape() == shape) return x;
  bool fits = x.shape().rank() <= shape.rank();
  for (int k = 1; fits && k <= x.shape().rank(); ++k) fits = x.shape()[-k] == shape[-k] || x.shape()[-k] == 1;
  if (!fits)
    throw ShapeError("[broadcast_to] x must have extents of shape " + shape.str() +
                     " or 1, counted from the last axis, got shape " + x.shape().str());
  const detail::Broadcast p("broadcast_to", shape, x.shape());
  T* y = nullptr;
  const Var<T> out = x.tape().output(shape, &y, {x});
  detail::for_broadcast(p, y, x.value(),
                        [&](Index i, Index n, const auto&, const auto& v) { detail::Out<T>(y + i, n) = v; });

  // dx sums over the repeats.
  x.tape().on_backward(out, [x, p](const T* dy) {
    bool fresh = false;
    T* dx = x.grad_acc(&fresh);
    detail::put_sums(x.tape(), dy, p.summed(p.b), 1, dx, fresh);
  });
  return out;
}

template <class T>
Var<T> pad(Var<T> x, int axis, Index before, Index after, double value) {
  axis = check_axis("pad", "axis", axis, x.shape());
  if (before < 0 || after < 0)
    throw ValueError("[pad] before and after must be 0 or more, got " + std::to_string(before) + " and " +
                     std::to_string(after));
  const Index extent = padded_extent(x.shape(), axis, before, after);
  const detail::Split p = detail::split(x.shape(), axis);
  const Index row = extent * p.inner, first = before * p.inner, kept = p.n * p.inner;
  T* y = nullptr;
  const Var<T> out = x.tape().output(detail::with_extent(x.shape(), axis, extent), &y, {x});
  const T fill = static_cast<T>(value);
  parallel_for(p.outer, detail::row_grain(row), [&](Index r0, Index r1) {
    for (Index r = r0; r < r1; ++r) {
      T* to = std::fill_n(y + r * row, first, fill);
      to = std::copy_n(x.value() + r * kept, kept, to);
      std::fill_n(to, row - first - kept, fill);
    }
  });

  // dx is the inner part of dy. A chunk owns its rows.
  x.tape().on_backward(out, [x, outer = p.outer, row, first, kept](const T* dy) {
    bool fresh = false;
    T* dx = x.grad_acc(&fresh);
    parallel_for(outer, detail::row_grain(kept), [=](Index r0, Index r1) {
      for (Index r = r0; r < r1; ++r)
        detail::put(detail::Out<T>(dx + r * kept, kept), detail::In<T>(dy + r * row + first, kept), fresh);
    });
  });
  return out;
}

template <class T>
Var<T> cumsum(Var<T> x, int axis) {
  const detail::Split p = detail::split(x.shape(), check_axis("cumsum", "axis", axis, x.shape()));
  T* y = nullptr;
  const Var<T> out = x.tape().output(x.shape(), &y, {x});
  const Index columns = p.outer * p.inner;
  parallel_for(columns, detail::row_grain(p.n), [&](Index c0, Index c1) {
    for (Index c = c0; c < c1; ++c) {
      double sum = 0;
      const Index first = c / p.inner * p.n * p.inner + c % p.inner;
      for (Index k = 0; k < p.n; ++k) {
        sum += static_cast<double>(x.value()[first + k * p.inner]);
        y[first + k * p.inner] = static_cast<T>(sum);
      }
    }
  });

  // dx_k = dy_k + dy_(k+1) + ...: running sums from the end. A chunk owns its columns.
  x.tape().on_backward(out, [x, p, columns](const T* dy) {
    T* dx = x.grad_acc();
    parallel_for(columns, detail::row_grain(p.n), [=](Index c0, Index c1) {
      for (Index c = c0; c < c1; ++c) {
        double sum = 0;
        const Index first = c / p.inner * p.n * p.inner + c % p.inner;
        for (Index k = p.n - 1; k >= 0; --k) {
          sum += static_cast<double>(dy[first + k * p.inner]);
          dx[first + k * p.inner] += static_cast<T>(sum);
        }
      }
    });
  });
  return out;
}

#define FIELDMARK_LAYOUT(T)                               \
  template Var<T> reshape(Var<T>, Shape);                 \
  template Var<T> permute(Var<T>, std::span<const int>);  \
  template Var<T> transpose(Var<T>, int, int);            \
  template Var<T> broadcast_to(Var<T>, Shape);            \
  template Var<T> pad(Var<T>, int, Index, Index, double); \
  template Var<T> cumsum(Var<T>, int);
FIELDMARK_LAYOUT(float)
FIELDMARK_LAYOUT(double)
#undef FIELDMARK_LAYOUT

}  // namespace fieldmark
