#include <fieldmark/engine/dual/operators.h>
#include <fieldmark/engine/ops/fused.h>

#include "gradcheck_cases_parts.h"

namespace fieldmark {

using namespace gradcheck_parts;

namespace {
// Magnitudes from 1 to 2.5, where 1 / x is smooth enough for differences.
Tensor<double> far_from_zero(Shape shape, double phase) {
  Tensor<double> t = off_zero(shape, phase);
  for (double& v : t.data) v += v < 0 ? -0.9 : 0.9;
  return t;
}
}  // namespace

std::vector<GradcheckCase> fused_gradcheck_cases() {
  const auto a = off_zero({2, 3, 40}), b = off_zero({2, 3, 40}, 0.5), row = off_zero({40}, 1),
             column = off_zero({3, 1}, 2), one = off_zero({}, 3);
  const auto far = far_from_zero({2, 3, 40}, 0), divisor = far_from_zero({2, 3, 40}, 0.5);
  const auto swish = [](auto x, auto gain, auto bias) { return x * sigmoid(gain * x + bias); };
  return join(
      {make("fused: arithmetic of two",
            [](auto&, auto v) {
              return fused([](auto x, auto z) { return (x * z - x / z + 2 * x) / 3 - (1 - z) * (4 / x); },
                           v[0], v[1]);
            },
            {far, divisor}),
       make("fused: functions",
            [](auto&, auto v) {
              return fused(
                  [](auto x) {
                    return tanh(x) + softplus(x) * exp(-square(x)) + sqrt(abs(x)) + log(abs(x) + 0.5);
                  },
                  v[0]);
            },
            {a}),
       make("fused: kinks",
            [](auto&, auto v) {
              return fused(
                  [](auto x, auto z) { return relu(x) * minimum(x, z + 7) + maximum(x - 9, z) + abs(z); },
                  v[0], v[1]);
            },
            {a, b}),
       make("fused: one value as two inputs",
            [](auto&, auto v) {
              return fused([](auto x, auto z) { return reciprocal(x) * sigmoid(z); }, v[0], v[0]);
            },
            {far}),
       make("fused: rows, columns and one element repeat",
            [=](auto&, auto v) {
              return fused([=](auto x, auto r, auto c, auto o) { return swish(x, r, c) * o; }, v[0], v[1],
                           v[2], v[3]);
            },
            {a, row, column, one}),
       make("fused: an input without a part in the result",
            [](auto&, auto v) { return fused([](auto x, auto) { return x; }, v[0], v[1]); }, {a, a})});
}

}  // namespace fieldmark
