#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/layout.h>
#include <fieldmark/engine/ops/math.h>
#include <fieldmark/engine/ops/reduce_axes.h>
#include <fieldmark/engine/ops/softmax.h>
#include <fieldmark/engine/shape_checks.h>

#include <cmath>

#include "kernels/elementwise.h"
#include "ops/broadcast.h"

namespace fieldmark {
namespace {

// The reduced axes of a shape, and the shapes without them and with extent 1 instead.
struct Reduction {
  std::array<bool, Shape::kMaxRank> reduced{};
  Shape dropped, kept;
  Index count = 1;  // elements reduced to one

  Reduction(const char* op, const Shape& s, const Axes& axes) {
    for (const int given : axes.list()) {
      const int axis = check_axis(op, "axes: each", given, s);
      if (std::exchange(reduced[at(axis)], true))
        throw ValueError(std::string("[") + op + "] axes: axis " + std::to_string(axis) +
                         " must be named once, got it twice");
    }
    std::array<Index, Shape::kMaxRank> left{}, all{};
    std::size_t n = 0;
    for (int k = 0; k < s.rank(); ++k) {
      all[at(k)] = reduced[at(k)] ? 1 : s[k];
      if (reduced[at(k)])
        count *= s[k];
      else
        left[n++] = s[k];
    }
    dropped = Shape(std::span(left).first(n));
    kept = Shape(std::span(all).first(at(s.rank())));
  }

  const Shape& shape(KeepAxes keep) const { return keep == KeepAxes::yes ? kept : dropped; }
};

void check_not_empty(const char* op, const Shape& s, const Reduction& r) {
  if (r.count == 0)
    throw ShapeError(std::string("[") + op + "] x must have elements to reduce along the axes, got shape " +
                     s.str());
}

// y = factor sum x, and dx = factor dy. A chunk owns its elements.
template <class T>
Var<T> scaled_sum(Var<T> x, const Reduction& r, KeepAxes keep, double factor,
                  std::source_location from = std::source_location::current()) {
  detail::SummedAxes axes;
  for (int k = 0; k < x.shape().rank(); ++k) axes.add(x.shape()[k], r.reduced[at(k)]);
  T* y = nullptr;
  const Var<T> out = x.tape().output(r.shape(keep), &y, {x}, from);
  detail::put_sums(x.tape(), x.value(), axes, factor, y, true);
  x.tape().on_backward(out, [x, kept = r.kept, f = static_cast<T>(factor)](const T* dy) {
    bool fresh = false;
    T* dx = x.grad_acc(&fresh);
    const detail::Broadcast p("", x.shape(), kept);
    detail::for_broadcast(p, dx, dy, [=](Index i, Index n, const auto&, const auto& g) {
      detail::put(detail::Out<T>(dx + i, n), f * g, fresh);
    });
  });
  return out;
}

// Arranges x as rows [.., n] of the elements that are reduced together, in row-major order.
template <class T>
Var<T> as_rows(Var<T> x, const Reduction& r) {
  std::array<int, Shape::kMaxRank> order{};
  std::size_t k = 0;
  bool moved = false;
  for (const bool reduced : {false, true})
    for (int axis = 0; axis < x.shape().rank(); ++axis)
      if (r.reduced[at(axis)] == reduced) {
        moved = moved || static_cast<int>(k) != axis;
        order[k++] = axis;
      }
  if (moved) x = permute(x, std::span<const int>(order).first(k));
  return reshape(x, {r.dropped.size(), r.count});
}

// Returns the position of the first largest element of a row, or of the first NaN if there is one.
template <class T>
Index first_largest(const T* row, Index n) {
  Index best = 0;
  for (Index i = 0; i < n; ++i) {
    if (std::isnan(row[i])) return i;
    if (row[i] > row[best]) best = i;
  }
  return best;
}

}  // namespace

Axes::Axes(std::initializer_list<int> axes) : Axes(std::span(axes.begin(), axes.size())) {}

Axes::Axes(std::span<const int> axes) : count_(static_cast<int>(axes.size())) {
  if (axes.size() > axes_.size())
    throw ValueError("[axes] a shape has at most " + std::to_string(Shape::kMaxRank) + " axes, got " +
                     std::to_string(axes.size()));
  std::copy(axes.begin(), axes.end(), axes_.begin());
}

template <class T>
Var<T> sum(Var<T> x, const Axes& axes, KeepAxes keep) {
  return scaled_sum(x, Reduction("sum", x.shape(), axes), keep, 1);
}

template <class T>
Var<T> mean(Var<T> x, const Axes& axes, KeepAxes keep) {
  const Reduction r("mean", x.shape(), axes);
  check_not_empty("mean", x.shape(), r);
  return scaled_sum(x, r, keep, 1 / static_cast<double>(r.count));
}

template <class T>
Var<T> variance(Var<T> x, const Axes& axes, KeepAxes keep) {
  const Reduction r("variance", x.shape(), axes);
  check_not_empty("variance", x.shape(), r);
  return mean(square(sub(x, mean(x, axes, KeepAxes::yes))), axes, keep);
}

template <class T>
Var<T> max(Var<T> x, const Axes& axes, KeepAxes keep) {
  const Reduction r("max", x.shape(), axes);
  check_not_empty("max", x.shape(), r);
  const Var<T> rows = as_rows(x, r);
  const Index n = r.count, count = r.dropped.size();
  T* y = nullptr;
  const Var<T> out = x.tape().output(r.shape(keep), &y, {rows});
  auto* from = x.tape().template scratch<Index>(count);
  parallel_for(count, detail::row_grain(n), [&](Index r0, Index r1) {
    for (Index i = r0; i < r1; ++i) {
      from[i] = i * n + first_largest(rows.value() + i * n, n);
      y[i] = rows.value()[from[i]];
    }
  });

  // dx = dy at the largest, 0 elsewhere.
  x.tape().on_backward(out, [rows, from, count](const T* dy) {
    T* dx = rows.grad_acc();
    parallel_for(count, detail::kGrain, [=](Index r0, Index r1) {
      for (Index i = r0; i < r1; ++i) dx[from[i]] += dy[i];
    });
  });
  return out;
}

namespace kernels {
namespace {

// Computes e = exp(x - m) of a row and y = m + log sum e; returns the factor that turns e into the softmax.
// If the largest element is infinite, only elements equal to it count; if all are -infinity, so is y, and no
// element has a gradient.
template <class T>
T log_sum(const T* x, Index n, T* e, T* y) {
  const T m = x[first_largest(x, n)];
  if (std::isinf(m)) {
    T equal = 0;
    for (Index i = 0; i < n; ++i) equal += e[i] = x[i] == m ? T(1) : T(0);
    *y = m;
    return m > 0 ? 1 / equal : T(0);
  }
  const T z = FIELDMARK_KERNEL(exp_sum<T>)(x, m, e, n);
  *y = m + std::log(z);
  return 1 / z;
}

}  // namespace
}  // namespace kernels

template <class T>
Var<T> logsumexp(Var<T> x, const Axes& axes, KeepAxes keep) {
  const Reduction r("logsumexp", x.shape(), axes);
  check_not_empty("logsumexp", x.shape(), r);
  const Var<T> rows = as_rows(x, r);
  const Index n = r.count, count = r.dropped.size();
  T* y = nullptr;
  const Var<T> out = x.tape().output(r.shape(keep), &y, {rows});
  T *e = x.tape().scratch(count * n), *factor = x.tape().scratch(count);
  parallel_for(count, detail::row_grain(n), [&](Index r0, Index r1) {
    for (Index i = r0; i < r1; ++i) factor[i] = kernels::log_sum(rows.value() + i * n, n, e + i * n, y + i);
  });

  // dx = dy softmax(x). A chunk owns its rows.
  x.tape().on_backward(out, [rows, e, factor, count, n](const T* dy) {
    bool fresh = false;
    T* dx = rows.grad_acc(&fresh);
    parallel_for(count, detail::row_grain(n), [=](Index r0, Index r1) {
      for (Index i = r0; i < r1; ++i)
        detail::put(detail::Out<T>(dx + i * n, n), dy[i] * factor[i] * detail::In<T>(e + i * n, n), fresh);
    });
  });
  return out;
}

template <class T>
Var<T> softmax(Var<T> x, int axis) {
  axis = check_axis("softmax", "axis", axis, x.shape());
  const int last = x.shape().rank() - 1;
  return axis == last ? softmax(x) : transpose(softmax(transpose(x, axis, last)), axis, last);
}

#define FIELDMARK_REDUCE_AXES(T)                            \
  template Var<T> sum(Var<T>, const Axes&, KeepAxes);       \
  template Var<T> mean(Var<T>, const Axes&, KeepAxes);      \
  template Var<T> variance(Var<T>, const Axes&, KeepAxes);  \
  template Var<T> max(Var<T>, const Axes&, KeepAxes);       \
  template Var<T> logsumexp(Var<T>, const Axes&, KeepAxes); \
  template Var<T> softmax(Var<T>, int);
FIELDMARK_REDUCE_AXES(float)
FIELDMARK_REDUCE_AXES(double)
#undef FIELDMARK_REDUCE_AXES

}  // namespace fieldmark
