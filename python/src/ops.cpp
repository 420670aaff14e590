// Ops on elements, matrices and axes: name(x), name(a, b), with their options.
#include <fieldmark/engine/dual/arithmetic.h>
#include <fieldmark/engine/dual/layout.h>
#include <fieldmark/engine/dual/math.h>
#include <fieldmark/engine/dual/matrices.h>
#include <fieldmark/engine/dual/reduce.h>
#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/batched_matmul.h>
#include <fieldmark/engine/ops/cholesky.h>
#include <fieldmark/engine/ops/comparison.h>
#include <fieldmark/engine/ops/determinant.h>
#include <fieldmark/engine/ops/dropout.h>
#include <fieldmark/engine/ops/eigenvalues.h>
#include <fieldmark/engine/ops/gather.h>
#include <fieldmark/engine/ops/layout.h>
#include <fieldmark/engine/ops/linear_solve.h>
#include <fieldmark/engine/ops/math.h>
#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/ops/reduce.h>
#include <fieldmark/engine/ops/reduce_axes.h>
#include <fieldmark/engine/ops/relu_family.h>
#include <fieldmark/engine/ops/resample.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/engine/ops/softmax.h>
#include <pybind11/stl.h>

#include <limits>

#include "number_argument.h"
#include "tape_value.h"

namespace fieldmark::python {
namespace {

using namespace py::literals;

// None: all axes of x.
template <class T>
std::vector<int> axes_of(const char* op, const Value<T>& x, const py::object& axis) {
  std::vector<int> axes;
  if (axis.is_none()) {
    for (int k = 0; k < x.primal().shape().rank(); ++k) axes.push_back(k);
    return axes;
  }
  const bool one = PyIndex_Check(axis.ptr()) && !py::isinstance<py::array>(axis);
  try {
    return one ? std::vector<int>{axis.cast<int>()} : axis.cast<std::vector<int>>();
  } catch (const py::cast_error&) {  // no integers, or larger than an int
    py::module_::import("fieldmark._refusal").attr("refuse_axes")(op, axis);
    throw;
  }
}

// @throws ShapeError unless all extents are 0 or more and their product can be counted
Shape shape_from(const char* op, const std::vector<Index>& extents) {
  const Shape shape{std::span<const Index>(extents)};
  Index size = 1;
  for (const Index extent : extents)
    if (extent < 0 || (extent > 0 && size > std::numeric_limits<Index>::max() / extent))
      throw ShapeError("[" + std::string(op) +
                       "] shape must have extents of 0 or more that fit into memory, got " + shape.str());
    else
      size *= std::max<Index>(extent, 1);
  return shape;
}

// Binds name(x) for ops of one value without options.
template <class T>
void bind_maps(py::module_& module) {
  struct Map {
    const char* name;
    Var<T> (*map)(Var<T>);
    Dual<T> (*dual)(const Dual<T>&);  // null: without a tangent
    const char* text;
  };
  const Map maps[] = {
      {"relu", relu<T>, relu<T>, "max(x, 0); the gradient at 0 is 0."},
      {"sigmoid", sigmoid<T>, sigmoid<T>, "1 / (1 + exp(-x)), without overflow."},
      {"tanh", tanh<T>, tanh<T>, "The hyperbolic tangent."},
      {"exp", exp<T>, exp<T>, "exp(x); in float32 it stays finite, at most exp(88)."},
      {"truncated_exp", truncated_exp<T>, truncated_exp<T>,
       "exp(min(x, 15)), for densities; its gradient is y everywhere."},
      {"softplus", softplus<T>, softplus<T>, "log(1 + exp(x)), without overflow."},
      {"silu", silu<T>, silu<T>, "x / (1 + exp(-x)), also called swish."},
      {"gelu", gelu<T>, gelu<T>, "x P(x), P the distribution function of the standard normal."},
      {"normal_cdf", normal_cdf<T>, normal_cdf<T>,
       "(1 + erf(x / sqrt 2)) / 2, the distribution function of the standard normal."},
      {"negate", negate<T>, negate<T>, "-x."},
      {"reciprocal", reciprocal<T>, reciprocal<T>, "1 / x."},
      {"abs", abs<T>, abs<T>, "|x|; the gradient at 0 is 0."},
      {"square", square<T>, square<T>, "x^2."},
      {"sqrt", sqrt<T>, sqrt<T>, "The square root; NaN below 0."},
      {"log", log<T>, log<T>, "The natural logarithm; -infinity at 0, NaN below."},
      {"log1p", log1p<T>, log1p<T>, "log(1 + x), exact also for small x."},
      {"expm1", expm1<T>, expm1<T>, "exp(x) - 1, exact also for small x."},
      {"sin", sin<T>, sin<T>, "The sine of x in radians."},
      {"cos", cos<T>, cos<T>, "The cosine of x in radians."},
      {"inverse", inverse<T>, inverse<T>, "Inverses of matrices [.., n, n]. ValueError if one is singular."},
      {"cholesky", cholesky<T>, cholesky<T>,
       "The lower triangular L with L L^T = x of matrices [.., n, n]. ValueError if one is not positive "
       "definite."},
      {"determinant", determinant<T>, determinant<T>,
       "Determinants [..] of matrices [.., n, n], singular ones too."},
      {"log_determinant", log_determinant<T>, log_determinant<T>,
       "log |det x| [..] of matrices [.., n, n]. ValueError if one is singular."},
      {"symmetric_eigenvalues", symmetric_eigenvalues<T>, nullptr,
       "Eigenvalues [.., n] of symmetric matrices [.., n, n], ascending."},
      {"global_avg_pool", global_avg_pool<T>, global_avg_pool<T>,
       "The mean [N, C] over the pixels of images [N, H, W, C]."},
      {"space_to_depth", space_to_depth<T>, space_to_depth<T>,
       "Moves blocks of 2 x 2 pixels into channels: [N, H, W, C] to [N, H / 2, W / 2, 4 C]."}};
  for (const Map& m : maps)
    module.def(
        m.name,
        [m](const Value<T>& x) {
          if (x.dual().has_tangent() && m.dual) return x.with(m.dual(x.dual()));
          return x.with(m.map(x.get(m.name)));
        },
        "x"_a, once<T>(m.text));
}

// Binds detach(x), whose tangent is 0 too.
template <class T>
void bind_detach(py::module_& module) {
  module.def(
      "detach", [](const Value<T>& x) { return x.with(detach(x.primal())); }, "x"_a,
      once<T>("The values of x as a constant: no gradient passes."));
}

// Binds name(a, b).
template <class T>
void bind_pairs(py::module_& module) {
  struct Pair {
    const char* name;
    Var<T> (*pair)(Var<T>, Var<T>);
    Dual<T> (*dual)(const Dual<T>&, const Dual<T>&);  // null: no gradient passes
    const char* text;
  };
  const Pair pairs[] = {
      {"minimum", minimum<T>, minimum<T>, "The smaller of a and b, which broadcast; NaN where either is."},
      {"maximum", maximum<T>, maximum<T>, "The larger of a and b, which broadcast; NaN where either is."},
      {"greater", greater<T>, nullptr, "1 where a > b, else 0; no gradient passes."},
      {"less", less<T>, nullptr, "1 where a < b, else 0; no gradient passes."},
      {"equal", equal<T>, nullptr, "1 where a = b, else 0; no gradient passes."},
      {"matmul", batched_matmul<T>, batched_matmul<T>,
       "Products [.., m, n] of matrices [.., m, k] and [.., k, n], also a @ b."},
      {"solve", solve<T>, solve<T>,
       "x of a x = b, a [.., n, n], b [.., n, k]. ValueError if a matrix is singular."}};
  for (const Pair& p : pairs)
    module.def(
        p.name,
        [p](const Value<T>& a, const Value<T>& b) {
          const bool tangent = a.dual().has_tangent() || b.dual().has_tangent();
          if (tangent && p.dual) return a.with(p.dual(a.dual(), b.dual()));
          return a.with(p.pair(a.primal(), b.primal()));
        },
        "a"_a, "b"_a, once<T>(p.text));
}

// Binds elementwise maps and pairs with numbers.
template <class T>
void bind_maps_with_options(py::module_& module) {
  using V = const Value<T>&;
  module.def(
      "leaky_relu",
      [](V x, Number slope) { return x.with(on([&](auto v) { return leaky_relu(v, slope); }, x)); }, "x"_a,
      "slope"_a = 0.01, once<T>("x where x > 0, else slope x."));
  module.def(
      "elu", [](V x, Number alpha) { return x.with(on([&](auto v) { return elu(v, alpha); }, x)); }, "x"_a,
      "alpha"_a = 1.0, once<T>("x where x > 0, else alpha (exp(x) - 1)."));
  module.def(
      "affine",
      [](V x, Number factor, Number offset) {
        return x.with(on([&](auto v) { return affine(v, factor, offset); }, x));
      },
      "x"_a, "factor"_a, "offset"_a, once<T>("factor x + offset."));
  module.def(
      "clamp",
      [](V x, Number low, Number high) { return x.with(on([&](auto v) { return clamp(v, low, high); }, x)); },
      "x"_a, "low"_a, "high"_a,
      once<T>("min(max(x, low), high); the gradient passes where low <= x <= high."));
  module.def(
      "dropout",
      [](V x, Number p, std::uint64_t seed, std::uint64_t step, std::uint64_t stream) {
        return x.with(dropout(x.get("dropout"), p, CounterRng(seed, stream), step));
      },
      "x"_a, "p"_a, "seed"_a, "step"_a, "stream"_a = 0,
      once<T>("0 with probability p in [0, 1), else x / (1 - p). The mask is a function of seed, step and "
              "stream: give\n"
              "each training step its own `step` and each layer its own `stream`. ValueError if p is out of "
              "range."));
  module.def(
      "triangular_solve",
      [](V a, V b, Flag upper, Flag transposed) {
        const Triangle triangle{.upper = upper, .transposed = transposed};
        return a.with(on([&](auto u, auto v) { return triangular_solve(u, v, triangle); }, a, b));
      },
      "a"_a, "b"_a, "upper"_a = false, "transposed"_a = false,
      once<T>(
          "x of T x = b, T a triangle of a [.., n, n], or its transpose; b [.., n, k]. ValueError if T is\n"
          "singular."));
  module.def(
      "where",
      [](V mask, V a, V b) {
        return a.with(on([&](auto u, auto v) { return where(mask.primal(), u, v); }, a, b));
      },
      "mask"_a, "a"_a, "b"_a, once<T>("a where the mask is not 0, b where it is; the mask broadcasts."));
}

// Binds reductions over all elements, or over some axes.
template <class T>
void bind_reductions(py::module_& module) {
  struct Reduction {
    const char* name;
    Var<T> (*reduce)(Var<T>, const Axes&, KeepAxes);
    Dual<T> (*dual)(const Dual<T>&, const Axes&, KeepAxes);
    const char* text;
  };
  const Reduction reductions[] = {
      {"sum", sum<T>, sum<T>, "The sum over some axes, or over all; 0 of nothing."},
      {"mean", mean<T>, mean<T>, "The mean over some axes, or over all. ShapeError of nothing."},
      {"variance", variance<T>, variance<T>,
       "The mean of (x - mean)^2 over some axes, or over all. ShapeError of nothing."},
      {"max", max<T>, max<T>, "The largest element over some axes, or over all. ShapeError of nothing."},
      {"logsumexp", logsumexp<T>, logsumexp<T>,
       "log sum exp(x) over some axes, or over all. ShapeError of nothing."}};
  for (const Reduction& r : reductions)
    module.def(
        r.name,
        [r](const Value<T>& x, const py::object& axis, Flag keepdims) {
          const std::vector<int> axes = axes_of(r.name, x, axis);
          const Axes over{std::span<const int>(axes)};
          const KeepAxes keep = keepdims ? KeepAxes::yes : KeepAxes::no;
          if (x.dual().has_tangent()) return x.with(r.dual(x.dual(), over, keep));
          return x.with(r.reduce(x.primal(), over, keep));
        },
        "x"_a, "axis"_a = py::none(), "keepdims"_a = false, once<T>(r.text));
  module.def(
      "softmax",
      [](const Value<T>& x, int axis) { return x.with(on([&](auto v) { return softmax(v, axis); }, x)); },
      "x"_a, "axis"_a = -1, once<T>("exp(x) / sum exp(x) over one axis, shifted so that nothing overflows."));
}

template <class T>
Dual<T> joined(const std::vector<Value<T>>& xs, int axis) {
  std::vector<Var<T>> vars;
  std::vector<Dual<T>> duals;
  bool tangent = false;
  for (const auto& x : xs) {
    vars.push_back(x.primal());
    duals.push_back(x.dual());
    tangent = tangent || x.dual().has_tangent();
  }
  if (tangent) return concatenate(std::span<const Dual<T>>(duals), axis);
  return concatenate(std::span<const Var<T>>(vars), axis);
}

template <class T>
void bind_layout(py::module_& module) {
  module.def(
      "reshape",
      [](const Value<T>& x, const std::vector<Index>& shape) {
        const Shape to = shape_from("reshape", shape);
        return x.with(on([&](auto v) { return reshape(v, to); }, x));
      },
      "x"_a, "shape"_a, once<T>("The same elements, row-major, under another shape."));
  module.def(
      "broadcast_to",
      [](const Value<T>& x, const std::vector<Index>& shape) {
        const Shape to = shape_from("broadcast_to", shape);
        return x.with(on([&](auto v) { return broadcast_to(v, to); }, x));
      },
      "x"_a, "shape"_a, once<T>("Repeats x along axes of extent 1 and along new axes in front."));
  module.def(
      "permute",
      [](const Value<T>& x, const std::vector<int>& order) {
        return x.with(on([&](auto v) { return permute(v, std::span<const int>(order)); }, x));
      },
      "x"_a, "order"_a,
      once<T>("Puts the axes into another order: axis k of the result is axis order[k] of x."));
  module.def(
      "transpose",
      [](const Value<T>& x, int a, int b) {
        return x.with(on([&](auto v) { return transpose(v, a, b); }, x));
      },
      "x"_a, "a"_a = -2, "b"_a = -1, once<T>("Exchanges two axes; by default the last two."));
  module.def(
      "pad",
      [](const Value<T>& x, int axis, Index before, Index after, Number value) {
        require_within("pad", "before", before, 0);
        require_within("pad", "after", after, 0);
        return x.with(on([&](auto v) { return pad(v, axis, before, after, value); }, x));
      },
      "x"_a, "axis"_a, "before"_a, "after"_a, "value"_a = 0.0,
      once<T>("Adds constant elements before and after those of an axis."));
  module.def(
      "cumsum",
      [](const Value<T>& x, int axis) { return x.with(on([&](auto v) { return cumsum(v, axis); }, x)); },
      "x"_a, "axis"_a = -1, once<T>("Running sums along an axis."));
  module.def(
      "slice",
      [](const Value<T>& x, int axis, Index begin, Index count) {
        require_within("slice", "begin", begin, 0);
        require_within("slice", "count", count, 0);
        return x.with(on([&](auto v) { return slice(v, axis, begin, count); }, x));
      },
      "x"_a, "axis"_a, "begin"_a, "count"_a, once<T>("Entries begin .. begin + count - 1 of an axis."));
  module.def(
      "concatenate",
      [](const std::vector<Value<T>>& xs, int axis) {
        if (xs.empty()) throw ValueError("[concatenate] needs at least one value, got none");
        return xs.front().with(joined(xs, axis));
      },
      "xs"_a, "axis"_a = -1, once<T>("Joins values along an axis; their other axes are alike."));
}

// Reads an index; like every array of a pass, it stays read-only until the tape is reset.
template <class T>
Reading<std::int32_t> indices(const char* where, const Value<T>& x, const py::object& given) {
  const py::array index = x.tape->template reads<std::int32_t>(where, given);
  if (index.ndim() != 1)
    throw ShapeError("[" + std::string(where) + "] must have one axis, got shape " + shape_of(index).str());
  return {index, elements<std::int32_t>(index)};
}

template <class T>
void bind_indexing(py::module_& module) {
  module.def(
      "gather",
      [](const Value<T>& x, int axis, const py::object& index) {
        const auto read = indices("gather: index", x, index);
        return x.with(on([&](auto v) { return gather(v, axis, read.elements); }, x), read);
      },
      "x"_a, "axis"_a, "index"_a,
      once<T>("Entries of an axis by an index [N] of int32 in [0, extent), repeats allowed."));
  module.def(
      "scatter_add",
      [](const Value<T>& x, int axis, const py::object& index, Index extent) {
        const auto read = indices("scatter_add: index", x, index);
        return x.with(on([&](auto v) { return scatter_add(v, axis, read.elements, extent); }, x), read);
      },
      "x"_a, "axis"_a, "index"_a, "extent"_a,
      once<T>("Adds entry i of an axis to entry index[i] of one with this extent; index [N] of int32 in [0, "
              "extent)."));
}

}  // namespace

template <class T>
void bind_ops(py::module_& module) {
  bind_maps<T>(module);
  bind_detach<T>(module);
  bind_pairs<T>(module);
  bind_maps_with_options<T>(module);
  bind_reductions<T>(module);
  bind_layout<T>(module);
  bind_indexing<T>(module);
}
template void bind_ops<float>(py::module_&);
template void bind_ops<double>(py::module_&);

}  // namespace fieldmark::python
