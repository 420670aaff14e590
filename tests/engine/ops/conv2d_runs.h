#pragma once
#include <fieldmark/engine/ops/conv2d.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/each_isa.h"
#include "support/random.h"
#include "support/worst.h"

/// Values of a convolution, and its gradients for a cotangent equal to the values.
struct Conv2dResult {
  std::vector<float> y, dx, dw, db;
  bool operator==(const Conv2dResult&) const = default;
};

/// Runs conv2d(x, w, b, window...), the window an Activation or a ConvWindow and an Activation.
template <class... Window>
Conv2dResult run_conv2d(const fieldmark::Tensor<float>& x, const fieldmark::Tensor<float>& w,
                        const fieldmark::Tensor<float>& b, Window... window) {
  fieldmark::Tape<float> tape;
  fieldmark::Tensor<float> dx(x.shape), dw(w.shape), db(b.shape);
  const auto y = fieldmark::conv2d(tape.leaf(x, dx), tape.leaf(w, dw), tape.leaf(b, db), window...);
  const std::vector<float> values(y.value(), y.value() + y.shape().size());
  tape.backward(y, values);
  return {values, dx.data, dw.data, db.data};
}

/// Computes the definition with stride and padding in double.
inline Conv2dResult plain_conv2d(const fieldmark::Tensor<float>& x, const fieldmark::Tensor<float>& w,
                                 const fieldmark::Tensor<float>& b, fieldmark::ConvWindow steps,
                                 fieldmark::Activation act) {
  using fieldmark::Index;
  const Index H = x.shape[1], W = x.shape[2], C = x.shape[3], K = w.shape[0], O = w.shape[3],
              s = steps.stride, p = steps.padding, OH = (H + 2 * p - K) / s + 1, OW = (W + 2 * p - K) / s + 1;
  std::vector<double> y(x.shape[0] * OH * OW * O), dx(x.size()), dw(w.size()), db(O);
  for (std::size_t at = 0; at < y.size(); ++at) {
    const Index o = at % O, j = at / O % OW, i = at / (O * OW) % OH, n = at / (O * OW * OH);
    const auto each = [&](auto&& f) {
      for (Index k = 0; k < K * K * C; ++k) {
        const Index r = i * s + k / (K * C) - p, c = j * s + k / C % K - p;
        if (r >= 0 && r < H && c >= 0 && c < W) f(((n * H + r) * W + c) * C + k % C, k * O + o);
      }
    };
    double sum = b[o];
    each([&](Index xi, Index wi) { sum += double(x[xi]) * w[wi]; });
    if (act == fieldmark::Activation::relu) sum = std::max(sum, 0.0);
    y[at] = sum;
    db[o] += sum;
    each([&](Index xi, Index wi) {
      dx[xi] += sum * w[wi];
      dw[wi] += sum * x[xi];
    });
  }
  const auto f = [](const std::vector<double>& v) { return std::vector<float>(v.begin(), v.end()); };
  return {f(y), f(dx), f(dw), f(db)};
}

/// The same with a centred window.
inline Conv2dResult plain_conv2d(const fieldmark::Tensor<float>& x, const fieldmark::Tensor<float>& w,
                                 const fieldmark::Tensor<float>& b, fieldmark::Activation act) {
  return plain_conv2d(x, w, b, {.stride = 1, .padding = w.shape[0] / 2}, act);
}

/// Returns the maximum absolute error relative to the largest magnitude.
inline double conv2d_error(const std::vector<float>& a, const std::vector<float>& b) {
  double worst = 0, size = 1e-30;
  for (std::size_t i = 0; i < a.size(); ++i) {
    raise_to(worst, std::abs(double(a[i]) - b[i]));
    raise_to(size, std::abs(double(b[i])));
  }
  return worst / size;
}
