#include <fieldmark/engine/ops/softmax.h>

#include <algorithm>
#include <cmath>

#include "kernels/elementwise.h"
#include "ops/weights.h"

namespace fieldmark {
namespace kernels {
namespace {

// Takes the maximum eight elements at a time, so that the loop vectorises. It may miss a NaN, but the
// exponential of the NaN remains.
template <class T>
T largest(const T* row, Index cols) {
  T most[8];
  std::fill_n(most, 8, row[0]);
  Index i = 0;
  for (; i + 8 <= cols; i += 8)
    for (Index k = 0; k < 8; ++k) most[k] = row[i + k] > most[k] ? row[i + k] : most[k];
  for (; i < cols; ++i) most[0] = std::max(most[0], row[i]);
  return *std::max_element(most, most + 8);
}

// p = softmax of each row. Calls log_sum(r, m, z) with the row's maximum m, where
// log sum_k exp x[r, k] = m + log z.
template <class T, class F>
void softmax_rows(const T* x, T* p, Index rows, Index cols, F log_sum) {
  const auto exp_row = FIELDMARK_KERNEL(exp_sum<T>);
  parallel_for(rows, detail::row_grain(cols), [&](Index r0, Index r1) {
    for (Index r = r0; r < r1; ++r) {
      const T* xr = x + r * cols;
      T* pr = p + r * cols;
      const T m = largest(xr, cols);
      const T z = exp_row(xr, m, pr, cols);
      for (Index c = 0; c < cols; ++c) pr[c] /= z;
      log_sum(r, m, z);
    }
  });
}

}  // namespace
}  // namespace kernels

namespace {

Index check_columns(const char* op, const char* arg, const Shape& s) {
  if (s.rank() == 0 || s[-1] == 0)
    throw ShapeError(std::string("[") + op + "] " + arg +
                     " must have at least one column [.., C], got shape " + s.str());
  return s.size() / s[-1];
}

void check_labels(Index rows, Index cols, std::span<const std::int32_t> labels) {
  if (static_cast<Index>(labels.size()) != rows)
    throw ShapeError("[softmax_cross_entropy] labels must have one element for each of the " +
                     std::to_string(rows) + " rows of logits, got " + std::to_string(labels.size()));
  for (std::size_t r = 0; r < labels.size(); ++r)
    if (labels[r] < -1 || labels[r] >= cols)
      throw ValueError("[softmax_cross_entropy] labels: entry " + std::to_string(r) + " must be in [-1, " +
                       std::to_string(cols) + ") (-1 or a column of logits), got " +
                       std::to_string(labels[r]));
}

// Sums a row without column c, in eight partial sums so that the loop vectorises.
template <class T>
T others(const T* row, Index cols, Index c) {
  T acc[8] = {};
  Index i = 0;
  for (; i + 8 <= cols; i += 8)
    for (Index k = 0; k < 8; ++k) acc[k] += i + k == c ? T(0) : row[i + k];
  for (; i < cols; ++i) acc[0] += i == c ? T(0) : row[i];
  return ((acc[0] + acc[1]) + (acc[2] + acc[3])) + ((acc[4] + acc[5]) + (acc[6] + acc[7]));
}

}  // namespace

template <class T>
Var<T> softmax(Var<T> x) {
  const Index rows = check_columns("softmax", "x", x.shape()), cols = x.shape()[-1];
  T* y = nullptr;
  const Var<T> out = x.tape().output(x.shape(), &y, {x});
  kernels::softmax_rows(x.value(), y, rows, cols, [](Index, T, T) {});

  // dy_i / dx_j = y_i (delta_ij - y_j), so dx = y (dy - <dy, y>). A chunk owns its rows.
  x.tape().on_backward(out, [x, y, rows, cols](const T* dy) {
    T* dx = x.grad_acc();
    parallel_for(rows, detail::row_grain(cols), [&](Index r0, Index r1) {
      for (Index r = r0; r < r1; ++r) {
        T dot = 0;
        for (Index i = r * cols; i < (r + 1) * cols; ++i) dot += dy[i] * y[i];
        for (Index i = r * cols; i < (r + 1) * cols; ++i) dx[i] += y[i] * (dy[i] - dot);
      }
    });
  });
  return out;
}

template <class T>
Var<T> softmax_cross_entropy(Var<T> logits, std::span<const std::int32_t> labels,
                             std::span<const std::type_identity_t<T>> weights) {
  const Index rows = check_columns("softmax_cross_entropy", "logits", logits.shape()),
              cols = logits.shape()[-1];
  if (rows == 0)
    throw ShapeError("[softmax_cross_entropy] logits must have at least one row [.., C], got shape " +
                     logits.shape().str());
  check_labels(rows, cols, labels);
  detail::check_weights("softmax_cross_entropy", rows, weights);
  Tape<T>& tape = logits.tape();
  T* w = tape.scratch(rows);  // 0 where a row is ignored
  for (std::size_t r = 0; r < labels.size(); ++r)
    w[r] = labels[r] < 0 ? T(0) : weights.empty() ? T(1) : weights[r];
  const double total = detail::chunked_sum(tape, rows, [w](Index r) { return w[r]; });
  if (total == 0)
    throw ValueError("[softmax_cross_entropy] labels: at least one row must count, got " +
                     std::to_string(rows) + " rows whose label is -1 or whose weight is 0");
  const double inverse = 1 / total;

  T *y = nullptr, *p = tape.scratch(rows * cols), *row_loss = tape.scratch(rows);
  const Var<T> out = tape.output({1}, &y, {logits});
  const std::int32_t* label = detail::kept(tape, labels);
  kernels::softmax_rows(logits.value(), p, rows, cols, [&](Index r, T m, T z) {
    const Index c = label[r];
    const T* row = logits.value() + r * cols;
    if (c < 0)
      row_loss[r] = 0;
    else if (row[c] < m)
      row_loss[r] = std::log(z) + (m - row[c]);  // at least log 2
    else
      row_loss[r] = std::log1p(others(p + r * cols, cols, c) * z);  // log z would lose small losses
  });
  *y = static_cast<T>(inverse * detail::chunked_sum(tape, rows, [=](Index r) {
                        return w[r] > 0 ? static_cast<double>(w[r]) * static_cast<double>(row_loss[r]) : 0.0;
                      }));

  // dL/dx[r, c] = w_r / sum w (p[r, c] - [c = label_r]), where p - 1 is minus the sum of the other p, so that
  // a near-certain label keeps its tiny slope. A chunk owns its rows.
  tape.on_backward(out, [logits, p, w, label, rows, cols, inverse](const T* dy) {
    T* dx = logits.grad_acc();
    const T g = static_cast<T>(inverse * static_cast<double>(*dy));
    parallel_for(rows, detail::row_grain(cols), [&](Index r0, Index r1) {
      for (Index r = r0; r < r1; ++r) {
        if (!(w[r] > 0)) continue;
        const T missing = others(p + r * cols, cols, label[r]);
        for (Index c = 0; c < cols; ++c)
          dx[r * cols + c] += g * w[r] * (c == label[r] ? -missing : p[r * cols + c]);
      }
    });
  });
  return out;
}

template Var<float> softmax(Var<float>);
template Var<double> softmax(Var<double>);
template Var<float> softmax_cross_entropy(Var<float>, std::span<const std::int32_t>, std::span<const float>);
template Var<double> softmax_cross_entropy(Var<double>, std::span<const std::int32_t>,
                                           std::span<const double>);

}  // namespace fieldmark
