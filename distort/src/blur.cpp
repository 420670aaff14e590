#include "fieldmark/distort/blur.h"

#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <cmath>

#include "checks.h"
#include "kernels/weighted_taps.h"

namespace fieldmark::distort {
namespace {

// An image with `r` columns of padding on both sides for its horizontal taps: rows of `pitch` elements,
// pixels from `pad`.
template <class T>
struct Filter {
  Index height, width, channels, r;
  const T *g, *dg;  // [2 r + 1] weights and their derivatives in sigma
  const T*
      tail;  // [r] sum of the weights beyond i: of the taps outside the image at distance i from its edge
  const Index* rows;     // [height + 2 r] where row i - r of the edge-extended image begins
  const Index* columns;  // [2 r + 1] k * channels

  Index taps() const { return 2 * r + 1; }
  Index row() const { return width * channels; }
  Index pad() const { return r * channels; }
  Index pitch() const { return row() + 2 * pad(); }
  Index grain() const { return 1 + (Index{1} << 14) / std::max<Index>(row(), 1); }
};

// g_k and dg_k/dsigma = g_k (k^2 - <k^2>) / sigma^3, in double. Where g_k underflows, so does its derivative.
template <class T>
void fill_weights(double sigma, Index r, T* g, T* dg, T* tail) {
  double sum = 0, second = 0;
  const auto weight = [&](Index k) {
    const double u = static_cast<double>(k) / sigma;
    return k == 0 ? 1.0 : std::exp(-0.5 * u * u);
  };
  for (Index k = -r; k <= r; ++k) {
    sum += weight(k);
    second += weight(k) * static_cast<double>(k * k);
  }
  for (Index k = -r; k <= r; ++k) {
    const double w = weight(k) / sum;
    const double slope = (static_cast<double>(k * k) - second / sum) / sigma / sigma / sigma;
    g[k + r] = static_cast<T>(w);
    dg[k + r] = second > 0 && w > 0 ? static_cast<T>(w * slope) : T(0);
  }
  double beyond = 0;
  for (Index i = r - 1; i >= 0; --i) tail[i] = static_cast<T>(beyond += static_cast<double>(g[i + 1 + r]));
}

template <class T>
Filter<T> make_filter(Tape<T>& tape, const Shape& x, T sigma) {
  Filter<T> f{x[0], x[1], x[2], std::max<Index>(1, static_cast<Index>(std::ceil(4 * sigma))), {}, {},
              {},   {},   {}};
  T* weights = tape.scratch(2 * f.taps() + f.r);
  fill_weights(static_cast<double>(sigma), f.r, weights, weights + f.taps(), weights + 2 * f.taps());
  auto* offsets = tape.template scratch<Index>(f.height + 2 * f.r + f.taps());
  for (Index i = 0; i < f.height + 2 * f.r; ++i)
    offsets[i] = std::clamp<Index>(i - f.r, 0, std::max<Index>(f.height - 1, 0)) * f.row();
  Index* columns = offsets + f.height + 2 * f.r;
  for (Index k = 0; k < f.taps(); ++k) columns[k] = k * f.channels;
  f.g = weights;
  f.dg = weights + f.taps();
  f.tail = weights + 2 * f.taps();
  f.rows = offsets;
  f.columns = columns;
  return f;
}

// Row i of the vertical pass with weights g; its edge pixels are repeated into the padding of `out`.
template <class T>
void vertical_row(const Filter<T>& f, const T* g, const T* x, Index i, T* out) {
  kernels::weighted_taps(out + f.pad(), x, f.rows + i, g, f.taps(), f.row(), false);
  for (Index k = 0; k < f.pad(); ++k) {
    out[k] = out[f.pad() + k % f.channels];
    out[f.pad() + f.row() + k] = out[f.row() + f.pad() - f.channels + k % f.channels];
  }
}

// d(half) of row i from dy: the transpose of the taps; taps outside the image add to the edge pixel. `zeros`
// is a row of the padded pitch.
template <class T>
void horizontal_backward_row(const Filter<T>& f, const T* dy, T* zeros, T* dhalf) {
  std::fill_n(zeros, f.pitch(), T(0));
  std::copy_n(dy, f.row(), zeros + f.pad());
  kernels::weighted_taps(dhalf, zeros, f.columns, f.g, f.taps(), f.row(), false);
  for (Index i = 0; i < std::min(f.r, f.width); ++i) {
    for (Index c = 0; c < f.channels; ++c) {
      dhalf[c] += f.tail[i] * dy[i * f.channels + c];
      dhalf[f.row() - f.channels + c] += f.tail[i] * dy[f.row() - (i + 1) * f.channels + c];
    }
  }
}

template <class T>
void vertical_backward_row(const Filter<T>& f, const T* dhalf, Index i, T* dx, bool add) {
  const Index first = std::max<Index>(0, i - f.r), last = std::min(f.height - 1, i + f.r);
  kernels::weighted_taps(dx, dhalf, f.rows + first + f.r, f.g + (first - i + f.r), last - first + 1, f.row(),
                         add);
  const Index edge = std::min(f.r, f.height);
  if (i == 0) kernels::weighted_taps(dx, dhalf, f.rows + f.r, f.tail, edge, f.row(), true);
  for (Index k = 0; i == f.height - 1 && k < edge; ++k)
    kernels::weighted_taps(dx, dhalf, f.rows + f.r + i - k, f.tail + k, 1, f.row(), true);
}

template <class T>
double dot(const T* a, const T* b, Index n) {
  double sum = 0;
  for (Index i = 0; i < n; ++i) sum += static_cast<double>(a[i]) * static_cast<double>(b[i]);
  return sum;
}

}  // namespace

template <class T>
Var<T> blur(Var<T> x, Var<T> sigma) {
  check_image("blur", x.shape());
  check_parameter("blur", "sigma", sigma.shape(), 1);
  check_range("blur", "sigma", static_cast<double>(sigma.value()[0]), 0, 1000,
              "a standard deviation in pixels");
  Tape<T>& tape = x.tape();
  T* y = nullptr;
  const Var<T> out = tape.output(x.shape(), &y, {x, sigma});
  if (x.shape().size() == 0) return out;
  const Filter<T> f = make_filter(tape, x.shape(), sigma.value()[0]);
  T* half = tape.scratch(f.height * f.pitch());
  parallel_for(f.height, f.grain(), [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      vertical_row(f, f.g, x.value(), i, half + i * f.pitch());
      kernels::weighted_taps(y + i * f.row(), half + i * f.pitch(), f.columns, f.g, f.taps(), f.row(), false);
    }
  });
  // y = V x H with V, H the weights along columns and rows. dhalf = dy H^T, dx = V^T dhalf, and
  //   dsigma = <dy, (V x) H'> + <dhalf, V' x>,   ' the derivative in sigma.
  // Rows own dhalf, dx and a share of dsigma; shares are added in row order.
  tape.on_backward(out, [x, sigma, f, half](const T* dy) {
    Tape<T>& t = x.tape();
    const Index row = f.row();
    T* dhalf = t.scratch(f.height * row);
    T* spare = t.scratch(f.height * f.pitch());
    double* shares = t.template scratch<double>(f.height);
    const bool with_sigma = sigma.needs_grad();
    parallel_for(f.height, f.grain(), [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        T* buffer = spare + i * f.pitch();
        horizontal_backward_row(f, dy + i * row, buffer, dhalf + i * row);
        if (!with_sigma) continue;
        kernels::weighted_taps(buffer, half + i * f.pitch(), f.columns, f.dg, f.taps(), row, false);
        shares[i] = dot(dy + i * row, buffer, row);
        kernels::weighted_taps(buffer, x.value(), f.rows + i, f.dg, f.taps(), row, false);
        shares[i] += dot(dhalf + i * row, buffer, row);
      }
    });
    bool fresh = false;
    if (T* dx = x.grad_acc(&fresh)) {
      parallel_for(f.height, f.grain(), [&](Index begin, Index end) {
        for (Index i = begin; i < end; ++i) vertical_backward_row(f, dhalf, i, dx + i * row, !fresh);
      });
    }
    if (!with_sigma) return;
    double sum = 0;
    for (Index i = 0; i < f.height; ++i) sum += shares[i];
    sigma.grad_acc()[0] += static_cast<T>(sum);
  });
  return out;
}

template Var<float> blur(Var<float>, Var<float>);
template Var<double> blur(Var<double>, Var<double>);

}  // namespace fieldmark::distort
