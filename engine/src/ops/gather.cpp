#include <fieldmark/engine/ops/gather.h>
#include <fieldmark/engine/shape_checks.h>

#include "ops/indexed.h"

namespace fieldmark {
namespace {
std::string entries_of(const char* arg, int axis) { return "axis " + std::to_string(axis) + " of " + arg; }
}  // namespace

template <class T>
Var<T> gather(Var<T> x, int axis, std::span<const std::int32_t> index) {
  axis = check_axis("gather", "axis", axis, x.shape());
  return detail::gather("gather", x, axis, index, entries_of("x", axis));
}

template <class T>
Var<T> scatter_add(Var<T> x, int axis, std::span<const std::int32_t> index, Index extent) {
  axis = check_axis("scatter_add", "axis", axis, x.shape());
  const Index n = x.shape()[axis];
  if (static_cast<Index>(index.size()) != n)
    throw ShapeError("[scatter_add] index must have one element for each of axis " + std::to_string(axis) +
                     " of x, whose shape is " + x.shape().str() + ", got " + std::to_string(index.size()));
  if (extent < 0) throw ValueError("[scatter_add] extent must be 0 or more, got " + std::to_string(extent));
  detail::check_index("scatter_add", index, extent, entries_of("y", axis));
  const Shape shape = detail::with_extent(x.shape(), axis, extent);
  const detail::Split p = detail::split(shape, axis);
  T* y = nullptr;
  const Var<T> out = x.tape().output(shape, &y, {x});
  const std::int32_t* i = detail::kept(x.tape(), index);
  std::fill_n(y, shape.size(), T(0));
  detail::add_taken(x.tape(), x.value(), p, i, n, y);

  // dx[o, i] = dy[o, index[i]]. A chunk owns its entries.
  x.tape().on_backward(out, [x, p, n, i](const T* dy) {
    bool fresh = false;
    T* dx = x.grad_acc(&fresh);
    detail::take(dy, p, i, n, dx, fresh);
  });
  return out;
}

#define FIELDMARK_GATHER(T)                                           \
  template Var<T> gather(Var<T>, int, std::span<const std::int32_t>); \
  template Var<T> scatter_add(Var<T>, int, std::span<const std::int32_t>, Index);
FIELDMARK_GATHER(float)
FIELDMARK_GATHER(double)
#undef FIELDMARK_GATHER

}  // namespace fieldmark
