#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/ops/layer_norm.h>
#include <fieldmark/engine/shape_checks.h>

#include <cmath>
#include <string>

#include "ops/axes.h"

namespace fieldmark {
namespace {

template <class T>
void check_layer_norm(const Var<T>& x, const Var<T>& gamma, const Var<T>& beta, double eps) {
  const Shape& s = x.shape();
  if (s.rank() == 0 || s[-1] == 0)
    throw ShapeError("[layer_norm] x must have at least one column [.., C], got shape " + s.str());
  check_rank("layer_norm", "gamma", gamma.shape(), 1, "[columns]");
  check_extent("layer_norm", "gamma", gamma.shape(), 0, s[-1], "columns of x");
  check_rank("layer_norm", "beta", beta.shape(), 1, "[columns]");
  check_extent("layer_norm", "beta", beta.shape(), 0, s[-1], "columns of x");
  check_number("layer_norm", "eps", eps, eps > 0, "above 0");
}

// Sums f(c) over a row, in double.
template <class F>
double row_sum(Index columns, F f) {
  double acc[4] = {};
  Index c = 0;
  for (; c + 4 <= columns; c += 4)
    for (Index j = 0; j < 4; ++j) acc[j] += f(c + j);
  for (; c < columns; ++c) acc[0] += f(c);
  return (acc[0] + acc[1]) + (acc[2] + acc[3]);
}

// With d = gamma dy, over a row: dx = rstd (d - mean(d) - xh mean(d xh)), where the last two terms come from
// mean and variance; dbeta and dgamma sum dy and dy xh over the rows. A chunk owns its rows of dx.
template <class T>
void layer_norm_backward(Var<T> x, Var<T> gamma, Var<T> beta, const T* xh, const double* rstd, const T* dy) {
  Tape<T>& t = x.tape();
  const Index columns = x.shape()[-1], rows = x.shape().size() / columns;
  const T* g = gamma.value();
  detail::SummedAxes over_rows;
  over_rows.add(rows, true);
  over_rows.add(columns, false);
  bool fresh = false;
  if (T* dbeta = beta.grad_acc(&fresh)) detail::put_sums(t, dy, over_rows, 1, dbeta, fresh);
  if (T* dgamma = gamma.grad_acc(&fresh)) {
    T* mixed = t.scratch(rows * columns);
    parallel_for(rows * columns, detail::kGrain, [=](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) mixed[i] = dy[i] * xh[i];
    });
    detail::put_sums(t, mixed, over_rows, 1, dgamma, fresh);
  }
  T* dx = x.grad_acc(&fresh);
  if (!dx) return;
  parallel_for(rows, detail::row_grain(columns), [=](Index r0, Index r1) {
    const double n = static_cast<double>(columns);
    for (Index r = r0; r < r1; ++r) {
      const T *d = dy + r * columns, *h = xh + r * columns;
      const auto weighed = [=](Index c) { return static_cast<double>(g[c]) * static_cast<double>(d[c]); };
      const double all = row_sum(columns, weighed) / n;
      const double steep =
          row_sum(columns, [=](Index c) { return weighed(c) * static_cast<double>(h[c]); }) / n;
      for (Index c = 0; c < columns; ++c) {
        const auto value = static_cast<T>(rstd[r] * (weighed(c) - all - static_cast<double>(h[c]) * steep));
        T& to = dx[r * columns + c];
        to = fresh ? value : to + value;
      }
    }
  });
}

}  // namespace

template <class T>
Var<T> layer_norm(Var<T> x, Var<T> gamma, Var<T> beta, double eps) {
  check_layer_norm(x, gamma, beta, eps);
  Tape<T>& tape = x.tape();
  const Index columns = x.shape()[-1], rows = x.shape().size() / columns;
  T *y = nullptr, *xh = tape.scratch(rows * columns);  // x with mean 0 and variance 1
  auto* rstd = tape.template scratch<double>(rows);
  const Var<T> out = tape.output(x.shape(), &y, {x, gamma, beta});
  const T *g = gamma.value(), *b = beta.value();
  parallel_for(rows, detail::row_grain(columns), [&](Index r0, Index r1) {
    const double n = static_cast<double>(columns);
    for (Index r = r0; r < r1; ++r) {
      const T* row = x.value() + r * columns;
      const double mean = row_sum(columns, [=](Index c) { return static_cast<double>(row[c]); }) / n;
      const auto centred = [=](Index c) { return static_cast<double>(row[c]) - mean; };
      rstd[r] = 1 / std::sqrt(row_sum(columns, [=](Index c) { return centred(c) * centred(c); }) / n + eps);
      for (Index c = 0; c < columns; ++c) {
        xh[r * columns + c] = static_cast<T>(centred(c) * rstd[r]);
        y[r * columns + c] = g[c] * xh[r * columns + c] + b[c];
      }
    }
  });

  tape.on_backward(out, [=](const T* dy) { layer_norm_backward(x, gamma, beta, xh, rstd, dy); });
  return out;
}

template Var<float> layer_norm(Var<float>, Var<float>, Var<float>, double);
template Var<double> layer_norm(Var<double>, Var<double>, Var<double>, double);

}  // namespace fieldmark
