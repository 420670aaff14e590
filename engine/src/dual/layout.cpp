#include <fieldmark/engine/dual/layout.h>

#include <algorithm>
#include <vector>

#include "dual/tangent.h"

namespace fieldmark {

using detail::linear;

template <class T>
Dual<T> reshape(const Dual<T>& x, Shape shape) {
  return linear(x, [=](Var<T> v) { return reshape(v, shape); });
}

template <class T>
Dual<T> permute(const Dual<T>& x, std::span<const int> order) {
  return linear(x, [=](Var<T> v) { return permute(v, order); });
}

template <class T>
Dual<T> transpose(const Dual<T>& x, int a, int b) {
  return linear(x, [=](Var<T> v) { return transpose(v, a, b); });
}

template <class T>
Dual<T> broadcast_to(const Dual<T>& x, Shape shape) {
  return linear(x, [=](Var<T> v) { return broadcast_to(v, shape); });
}

template <class T>
Dual<T> pad(const Dual<T>& x, int axis, Index before, Index after, double value) {
  return detail::with_tangent(pad(x.value(), axis, before, after, value), x,
                              [=](Var<T> t) { return pad(t, axis, before, after); });
}

template <class T>
Dual<T> cumsum(const Dual<T>& x, int axis) {
  return linear(x, [=](Var<T> v) { return cumsum(v, axis); });
}

namespace {

template <class T, class F>
Dual<T> joined(std::span<const Dual<T>> xs, F join) {
  std::vector<Var<T>> values, tangents;
  for (const Dual<T>& x : xs) values.push_back(x.value());
  const Var<T> y = join(std::span<const Var<T>>(values));
  if (std::none_of(xs.begin(), xs.end(), [](const Dual<T>& x) { return x.has_tangent(); })) return y;
  for (const Dual<T>& x : xs) tangents.push_back(x.tangent());
  return {y, join(std::span<const Var<T>>(tangents))};
}

}  // namespace

template <class T>
Dual<T> concatenate(std::span<const Dual<T>> xs) {
  return joined(xs, [](std::span<const Var<T>> v) { return concatenate(v); });
}

template <class T>
Dual<T> concatenate(std::span<const Dual<T>> xs, int axis) {
  return joined(xs, [=](std::span<const Var<T>> v) { return concatenate(v, axis); });
}

template <class T>
Dual<T> slice(const Dual<T>& x, Index begin, Index count) {
  return linear(x, [=](Var<T> v) { return slice(v, begin, count); });
}

template <class T>
Dual<T> slice(const Dual<T>& x, int axis, Index begin, Index count) {
  return linear(x, [=](Var<T> v) { return slice(v, axis, begin, count); });
}

template <class T>
Dual<T> gather(const Dual<T>& x, int axis, std::span<const std::int32_t> index) {
  return linear(x, [=](Var<T> v) { return gather(v, axis, index); });
}

template <class T>
Dual<T> scatter_add(const Dual<T>& x, int axis, std::span<const std::int32_t> index, Index extent) {
  return linear(x, [=](Var<T> v) { return scatter_add(v, axis, index, extent); });
}

template <class T>
Dual<T> broadcast_rows(const Dual<T>& x, Index rows) {
  return linear(x, [=](Var<T> v) { return broadcast_rows(v, rows); });
}

template <class T>
Dual<T> gather_rows(const Dual<T>& x, std::span<const std::int32_t> index) {
  return linear(x, [=](Var<T> v) { return gather_rows(v, index); });
}

template <class T>
Dual<T> avg_pool(const Dual<T>& x, Index size) {
  return linear(x, [=](Var<T> v) { return avg_pool(v, size); });
}

template <class T>
Dual<T> global_avg_pool(const Dual<T>& x) {
  return linear(x, [](Var<T> v) { return global_avg_pool(v); });
}

template <class T>
Dual<T> upsample_nearest(const Dual<T>& x, Index factor) {
  return linear(x, [=](Var<T> v) { return upsample_nearest(v, factor); });
}

template <class T>
Dual<T> upsample_to(const Dual<T>& x, Index height, Index width, Interpolation mode) {
  return linear(x, [=](Var<T> v) { return upsample_to(v, height, width, mode); });
}

template <class T>
Dual<T> space_to_depth(const Dual<T>& x) {
  return linear(x, [](Var<T> v) { return space_to_depth(v); });
}

#define FIELDMARK_DUAL_LAYOUT(T)                                                           \
  template Dual<T> reshape(const Dual<T>&, Shape);                                         \
  template Dual<T> permute(const Dual<T>&, std::span<const int>);                          \
  template Dual<T> transpose(const Dual<T>&, int, int);                                    \
  template Dual<T> broadcast_to(const Dual<T>&, Shape);                                    \
  template Dual<T> pad(const Dual<T>&, int, Index, Index, double);                         \
  template Dual<T> cumsum(const Dual<T>&, int);                                            \
  template Dual<T> concatenate(std::span<const Dual<T>>);                                  \
  template Dual<T> concatenate(std::span<const Dual<T>>, int);                             \
  template Dual<T> slice(const Dual<T>&, Index, Index);                                    \
  template Dual<T> slice(const Dual<T>&, int, Index, Index);                               \
  template Dual<T> gather(const Dual<T>&, int, std::span<const std::int32_t>);             \
  template Dual<T> scatter_add(const Dual<T>&, int, std::span<const std::int32_t>, Index); \
  template Dual<T> broadcast_rows(const Dual<T>&, Index);                                  \
  template Dual<T> gather_rows(const Dual<T>&, std::span<const std::int32_t>);             \
  template Dual<T> avg_pool(const Dual<T>&, Index);                                        \
  template Dual<T> global_avg_pool(const Dual<T>&);                                        \
  template Dual<T> upsample_nearest(const Dual<T>&, Index);                                \
  template Dual<T> upsample_to(const Dual<T>&, Index, Index, Interpolation);               \
  template Dual<T> space_to_depth(const Dual<T>&);
FIELDMARK_DUAL_LAYOUT(float)
FIELDMARK_DUAL_LAYOUT(double)
#undef FIELDMARK_DUAL_LAYOUT

}  // namespace fieldmark
