#include <fieldmark/engine/dual/arithmetic.h>
#include <fieldmark/engine/dual/layout.h>
#include <fieldmark/engine/dual/math.h>
#include <fieldmark/engine/dual/matrices.h>
#include <fieldmark/engine/dual/norm.h>
#include <fieldmark/engine/dual/reduce.h>
#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/batched_matmul.h>
#include <fieldmark/engine/ops/cholesky.h>
#include <fieldmark/engine/ops/comparison.h>
#include <fieldmark/engine/ops/determinant.h>
#include <fieldmark/engine/ops/eigenvalues.h>
#include <fieldmark/engine/ops/gather.h>
#include <fieldmark/engine/ops/layer_norm.h>
#include <fieldmark/engine/ops/layout.h>
#include <fieldmark/engine/ops/linear_solve.h>
#include <fieldmark/engine/ops/math.h>
#include <fieldmark/engine/ops/reduce_axes.h>
#include <fieldmark/engine/ops/relu_family.h>
#include <fieldmark/engine/ops/slice.h>

#include <array>

#include "gradcheck_cases_parts.h"

namespace fieldmark {
namespace {

using namespace gradcheck_parts;

constexpr std::array<std::int32_t, 5> kPicks{2, 0, 2, 1, 2};

// off_zero() with every value made positive: 0.1 to 1.6.
Tensor<double> positive(Shape shape, double phase = 0) {
  Tensor<double> t = off_zero(shape, phase);
  for (double& v : t.data) v = std::abs(v);
  return t;
}

// Multiples of 1/5 plus an offset: differences must not step over kinks 1/10 away.
Tensor<double> stepped(Shape shape, double phase, double offset = 0) {
  Tensor<double> t = off_zero(shape, phase);
  for (double& v : t.data) v = std::round(5 * v) / 5 + offset;
  return t;
}

// Matrices far from singular: noise on a diagonal of 3, 4, ...
Tensor<double> regular(Index batch, Index n) {
  Tensor<double> t = mixed({batch, n, n}, 1);
  for (Index i = 0; i < batch; ++i)
    for (Index k = 0; k < n; ++k) t[(i * n + k) * n + k] += 3 + static_cast<double>(k);
  return t;
}

Cases broadcast_cases() {
  const auto a = off_zero({2, 3, 4}), row = off_zero({4}, 0.5), column = off_zero({3, 1}, 1),
             one = off_zero({}, 2);
  const auto base = positive({2, 3, 4}), base_row = positive({4}, 0.5);
  return join(
      {make("arithmetic: add of a row", [](auto&, auto v) { return add(v[0], v[1]); }, {a, row}),
       make("arithmetic: sub of a column and a row", [](auto&, auto v) { return sub(v[0], v[1]); },
            {column, row}),
       make("arithmetic: mul with one element", [](auto&, auto v) { return mul(v[0], v[1]); }, {one, a}),
       make("arithmetic: div", [](auto&, auto v) { return div(v[0], v[1]); }, {a, base}),
       make("arithmetic: div by a row", [](auto&, auto v) { return div(v[0], v[1]); }, {a, base_row}),
       make("arithmetic: pow", [](auto&, auto v) { return pow(v[0], v[1]); }, {base, row}),
       make("arithmetic: minimum", [](auto&, auto v) { return minimum(v[0], v[1]); },
            {stepped({2, 3, 4}, 0), stepped({2, 3, 4}, 1, 0.1)}),
       make("arithmetic: maximum of a column", [](auto&, auto v) { return maximum(v[0], v[1]); },
            {stepped({2, 3, 4}, 0), stepped({3, 1}, 1, 0.1)}),
       make("comparison: where", [](auto&, auto v) { return where(greater(v[0], v[1]), v[0], square(v[1])); },
            {stepped({2, 3, 4}, 0), stepped({3, 1}, 1, 0.1)})});
}

Cases function_cases() {
  const auto x = off_zero({3, 4}), p = positive({3, 4});
  return join(
      {make("math: negate", [](auto&, auto v) { return negate(v[0]); }, {x}),
       make("math: affine", [](auto&, auto v) { return affine(v[0], -2.5, 3); }, {x}),
       make("math: div by a number", [](auto&, auto v) { return div(v[0], -2.5); }, {x}),
       make("math: reciprocal", [](auto&, auto v) { return reciprocal(v[0]); }, {regular(1, 1)}),
       make("math: abs", [](auto&, auto v) { return abs(v[0]); }, {x}),
       make("math: square", [](auto&, auto v) { return square(v[0]); }, {x}),
       make("math: sqrt", [](auto&, auto v) { return sqrt(affine(v[0], 1, 1)); }, {p}),
       make("math: pow", [](auto&, auto v) { return pow(affine(v[0], 1, 1), -1.5); }, {p}),
       make("math: pow of negative numbers", [](auto&, auto v) { return pow(v[0], 3); }, {x}),
       make("math: log", [](auto&, auto v) { return log(affine(v[0], 1, 1)); }, {p}),
       make("math: log1p", [](auto&, auto v) { return log1p(v[0]); }, {p}),
       make("math: expm1", [](auto&, auto v) { return expm1(v[0]); }, {x}),
       make("math: sin", [](auto&, auto v) { return sin(v[0]); }, {x}),
       make("math: cos", [](auto&, auto v) { return cos(v[0]); }, {x}),
       make("math: clamp", [](auto&, auto v) { return clamp(v[0], -0.5, 0.5); }, {stepped({3, 4}, 0)}),
       make("relu_family: leaky_relu", [](auto&, auto v) { return leaky_relu(v[0], 0.2); }, {x}),
       make("relu_family: elu", [](auto&, auto v) { return elu(v[0], 0.7); }, {x}),
       make("relu_family: silu", [](auto&, auto v) { return silu(v[0]); }, {x}),
       make("relu_family: gelu", [](auto&, auto v) { return gelu(v[0]); }, {x}),
       make("relu_family: normal_cdf", [](auto&, auto v) { return normal_cdf(v[0]); }, {x})});
}

Cases axis_cases() {
  const auto x = off_zero({2, 3, 4}), y = off_zero({2, 2, 4}, 0.5);
  return join({make("reduce_axes: sum",
                    [](auto&, auto v) {
                      return sum(v[0], {0, 2});
                    },
                    {x}),
               make("reduce_axes: sum, mul by what it came from",
                    [](auto&, auto v) { return mul(v[0], sum(v[0], {1}, KeepAxes::yes)); }, {x}),
               make("reduce_axes: mean", [](auto&, auto v) { return mean(v[0], {1}); }, {x}),
               make("reduce_axes: variance",
                    [](auto&, auto v) {
                      return variance(v[0], {0, -1});
                    },
                    {x}),
               make("reduce_axes: max",
                    [](auto&, auto v) {
                      return max(v[0], {0, 1}, KeepAxes::yes);
                    },
                    {apart({2, 3, 4})}),
               make("reduce_axes: logsumexp", [](auto&, auto v) { return logsumexp(v[0], {1}); }, {x}),
               make("reduce_axes: softmax", [](auto&, auto v) { return softmax(v[0], 1); }, {x}),
               make("layout: reshape",
                    [](auto&, auto v) {
                      return reshape(v[0], {4, 6});
                    },
                    {x}),
               make("layout: permute",
                    [](auto&, auto v) {
                      return permute(v[0], {2, 0, 1});
                    },
                    {x}),
               make("layout: transpose", [](auto&, auto v) { return transpose(v[0]); }, {x}),
               make("layout: broadcast_to",
                    [](auto&, auto v) {
                      return broadcast_to(v[0], {2, 3, 4});
                    },
                    {off_zero({3, 1})}),
               make("layout: pad", [](auto&, auto v) { return pad(v[0], 1, 2, 1, 0.5); }, {x}),
               make("layout: cumsum", [](auto&, auto v) { return cumsum(v[0], 1); }, {x}),
               make("slice: slice of an inner axis", [](auto&, auto v) { return slice(v[0], 1, 1, 2); }, {x}),
               make("slice: concatenate along an inner axis",
                    [](auto&, auto v) {
                      return concatenate({v[0], v[1], v[0]}, 1);
                    },
                    {x, y}),
               make("gather: gather", [](auto&, auto v) { return gather(v[0], 1, kPicks); }, {x}),
               make("gather: scatter_add", [](auto&, auto v) { return scatter_add(v[0], 1, kPicks, 4); },
                    {off_zero({2, 5, 3})})});
}

Cases matrix_cases() {
  const auto a = regular(2, 3), b = mixed({2, 3, 2}, 2);
  return join(
      {make("batched_matmul: a, b", [](auto&, auto v) { return batched_matmul(v[0], v[1]); }, {a, b}),
       make("batched_matmul: one b for all", [](auto&, auto v) { return batched_matmul(v[0], v[1]); },
            {a, mixed({3, 4}, 3)}),
       make("batched_matmul: one a for all", [](auto&, auto v) { return batched_matmul(v[0], v[1]); },
            {mixed({4, 3}, 3), b}),
       make("layer_norm: x, gamma, beta", [](auto&, auto v) { return layer_norm(v[0], v[1], v[2]); },
            {off_zero({2, 3, 4}), off_zero({4}, 1), off_zero({4}, 2)}),
       make("linear_solve: triangular_solve", [](auto&, auto v) { return triangular_solve(v[0], v[1]); },
            {a, b}),
       make("linear_solve: triangular_solve, upper, transposed",
            [](auto&, auto v) { return triangular_solve(v[0], v[1], {.upper = true, .transposed = true}); },
            {a, b}),
       make("linear_solve: solve", [](auto&, auto v) { return solve(v[0], v[1]); }, {a, b}),
       make("linear_solve: inverse", [](auto&, auto v) { return inverse(v[0]); }, {a}),
       make("determinant: determinant", [](auto&, auto v) { return determinant(v[0]); }, {a}),
       make("determinant: log_determinant", [](auto&, auto v) { return log_determinant(v[0]); }, {a}),
       make("cholesky: of symmetric parts", [](auto&, auto v) { return cholesky(v[0]); }, {a}),
       make("eigenvalues: symmetric_eigenvalues", [](D&, Vars v) { return symmetric_eigenvalues(v[0]); },
            {a})});
}

}  // namespace

std::vector<GradcheckCase> tensor_gradcheck_cases() {
  return join({broadcast_cases(), function_cases(), axis_cases(), matrix_cases()});
}

}  // namespace fieldmark
