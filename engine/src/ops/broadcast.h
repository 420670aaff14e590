#pragma once
// Elementwise ops of two tensors whose shapes broadcast. Private.
#include <string>

#include "ops/axes.h"
#include "ops/elementwise.h"

namespace fieldmark::detail {

// How two shapes broadcast. Axes on which both operands behave alike are joined, so that equal shapes have
// one axis. The last axis is contiguous in an operand or repeats one element of it.
struct Broadcast {
  struct Operand {
    std::array<bool, Shape::kMaxRank> repeats{};
    std::array<Index, Shape::kMaxRank> stride{};
    bool whole = true;  // no axis repeats
  };
  Shape shape;  // of the result
  int axes = 0;
  std::array<Index, Shape::kMaxRank> extent{};
  Operand a, b;

  Broadcast(const char* op, const Shape& sa, const Shape& sb) {
    std::array<Index, Shape::kMaxRank> extents{};
    const int rank = std::max(sa.rank(), sb.rank());
    for (int k = 0; k < rank; ++k) {
      const Index ea = extent_of(sa, k, rank), eb = extent_of(sb, k, rank), n = ea == 1 ? eb : ea;
      if (eb != n && eb != 1)
        throw ShapeError(std::string("[") + op + "] b must broadcast with a, whose shape is " + sa.str() +
                         " (extents equal or 1, counted from the last axis), got shape " + sb.str());
      extents[at(k)] = n;
      if (n != 1) join(n, ea == 1, eb == 1);
    }
    shape = Shape(std::span(extents).first(at(rank)));
    if (axes == 0) join(1, false, false);
    set_strides(a);
    set_strides(b);
  }

  // Returns the axes that the gradient of an operand sums over.
  SummedAxes summed(const Operand& o) const {
    SummedAxes s;
    for (int k = 0; k < axes; ++k) s.add(extent[at(k)], o.repeats[at(k)]);
    return s;
  }

  // Calls f(i, offset in a, offset in b, n) for runs of n elements along the last axis, covering
  // [begin, end).
  template <class F>
  void for_runs(Index begin, Index end, F f) const {
    const auto last = at(axes - 1);
    const Index inner = extent[last];
    for (Index i = begin; i < end;) {
      const Index within = i % inner, n = std::min(inner - within, end - i);
      Index pa = within * a.stride[last], pb = within * b.stride[last], rest = i / inner;
      for (int k = axes - 2; k >= 0; --k) {
        pa += rest % extent[at(k)] * a.stride[at(k)];
        pb += rest % extent[at(k)] * b.stride[at(k)];
        rest /= extent[at(k)];
      }
      f(i, pa, pb, n);
      i += n;
    }
  }

 private:
  static Index extent_of(const Shape& s, int k, int rank) {
    const int own = k - (rank - s.rank());
    return own < 0 ? 1 : s[own];
  }
  void join(Index n, bool repeats_a, bool repeats_b) {
    if (axes > 0 && a.repeats[at(axes - 1)] == repeats_a && b.repeats[at(axes - 1)] == repeats_b) {
      extent[at(axes - 1)] *= n;
      return;
    }
    extent[at(axes)] = n;
    a.repeats[at(axes)] = repeats_a;
    b.repeats[at(axes++)] = repeats_b;
  }
  void set_strides(Operand& o) const {
    Index stride = 1;
    for (int k = axes - 1; k >= 0; --k) {
      o.stride[at(k)] = o.repeats[at(k)] ? 0 : stride;
      if (!o.repeats[at(k)]) stride *= extent[at(k)];
      o.whole = o.whole && !o.repeats[at(k)];
    }
  }
};

// Calls f(i, n, a, b) in parallel for runs of the result, a and b being arrays or repeated elements.
template <class T, class F>
void for_broadcast(const Broadcast& p, const T* a, const T* b, F f) {
  const auto last = at(p.axes - 1);
  parallel_for(p.shape.size(), kGrain, [&](Index begin, Index end) {
    p.for_runs(begin, end, [&](Index i, Index pa, Index pb, Index n) {
      if (p.a.repeats[last])
        f(i, n, Array<T>::Constant(n, a[pa]), In<T>(b + pb, n));
      else if (p.b.repeats[last])
        f(i, n, In<T>(a + pa, n), Array<T>::Constant(n, b[pb]));
      else
        f(i, n, In<T>(a + pa, n), In<T>(b + pb, n));
    });
  });
}

// dx = or += slope(a, b, dy), summed over the axes on which x (a or b) repeats.
template <class T, class D>
void put_broadcast_gradient(const Broadcast& p, const Broadcast::Operand& o, Var<T> x, Var<T> a, Var<T> b,
                            const T* dy, D slope) {
  if (!x.needs_grad()) return;
  bool fresh = false;
  T* dx = x.grad_acc(&fresh);
  T* to = o.whole ? dx : x.tape().scratch(p.shape.size());
  const bool assign = !o.whole || fresh;
  for_broadcast(p, a.value(), b.value(), [&](Index i, Index n, const auto& va, const auto& vb) {
    put(Out<T>(to + i, n), slope(va, vb, In<T>(dy + i, n)), assign);
  });
  if (!o.whole) put_sums(x.tape(), to, p.summed(o), 1, dx, fresh);
}

// binary() for equal shapes, without a Broadcast plan, which would double the time of small ops.
template <class T, class F, class A, class B>
Var<T> binary_of_equal(Var<T> a, Var<T> b, F f, A slope_a, B slope_b, std::source_location from) {
  T* y = nullptr;
  const Var<T> out = a.tape().output(a.shape(), &y, {a, b}, from);
  parallel_for(a.shape().size(), kGrain, [&](Index begin, Index end) {
    const Index n = end - begin;
    Out<T>(y + begin, n) = f(In<T>(a.value() + begin, n), In<T>(b.value() + begin, n));
  });
  a.tape().on_backward(out, [a, b, slope_a, slope_b](const T* dy) {
    const auto put_gradient = [&](Var<T> x, auto slope) {
      bool fresh = false;
      T* dx = x.grad_acc(&fresh);
      if (!dx) return;
      parallel_for(x.shape().size(), kGrain, [&](Index begin, Index end) {
        const auto part = [&](const T* p) { return In<T>(p + begin, end - begin); };
        put(Out<T>(dx + begin, end - begin), slope(part(a.value()), part(b.value()), part(dy)), fresh);
      });
    };
    put_gradient(a, slope_a);
    put_gradient(b, slope_b);
  });
  return out;
}

// y = f(a, b) with the backwards da = slope_a(a, b, dy) and db = slope_b(a, b, dy), all array expressions. A
// chunk owns its elements; sums over repeated elements run in double.
template <class T, class F, class A, class B>
Var<T> binary(const char* op, Var<T> a, Var<T> b, F f, A slope_a, B slope_b,
              std::source_location from = std::source_location::current()) {
  if (a.shape() == b.shape()) return binary_of_equal(a, b, f, slope_a, slope_b, from);
  const Broadcast p(op, a.shape(), b.shape());
  T* y = nullptr;
  const Var<T> out = a.tape().output(p.shape, &y, {a, b}, from);
  for_broadcast(p, a.value(), b.value(),
                [&](Index i, Index n, const auto& va, const auto& vb) { Out<T>(y + i, n) = f(va, vb); });
  a.tape().on_backward(out, [a, b, slope_a, slope_b](const T* dy) {
    const Broadcast q("", a.shape(), b.shape());
    put_broadcast_gradient(q, q.a, a, a, b, dy, slope_a);
    put_broadcast_gradient(q, q.b, b, a, b, dy, slope_b);
  });
  return out;
}

}  // namespace fieldmark::detail
