#pragma once
#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/shape_checks.h>
#include <cmath>
#include <cstdint>

#include "kernels/norm.h"
#include "ops/chunks.h"

// Shared by group and batch normalisation: x is [images, pixels, channels], and statistics belong to a group
// of channels of an image. Batch normalisation is one image of all pixels with as many groups as channels.
namespace fieldmark::kernels {

struct NormLayout {
  Index images, pixels, channels, groups;
  Index block() const { return detail::row_grain(channels); }             // pixels of one chunk
  Index blocks() const { return (pixels + block() - 1) / block(); }       // chunks of one image
  Index width() const { return channels / groups; }                       // channels of one group
  double count() const { return static_cast<double>(pixels * width()); }  // elements of one group
};

// Calls f(image, chunk, first pixel's offset into x, pixels of the chunk).
template <class F>
void for_blocks(const NormLayout& l, F f) {
  detail::for_image_chunks(l.images, l.pixels, l.block(), [&](Index image, Index first, Index count) {
    f(image, image * l.blocks() + first / l.block(), (image * l.pixels + first) * l.channels, count);
  });
}

// Computes the mean and variance [images, groups] of each group of an image. Merges chunks in order (Chan et
// al. 1983), so that nothing cancels for a nearly constant image, and a constant one has variance 0.
template <class T>
void group_statistics(Tape<T>& tape, const NormLayout& l, const T* x, double* mean, double* variance) {
  const Index n = l.images * l.blocks() * l.channels;
  auto *chunk_mean = tape.template scratch<double>(n), *chunk_m2 = tape.template scratch<double>(n);
  const auto moments = FIELDMARK_KERNEL(channel_moments<T>);
  for_blocks(l, [&](Index, Index chunk, Index at, Index pixels) {
    moments(x + at, pixels, l.channels, chunk_mean + chunk * l.channels, chunk_m2 + chunk * l.channels);
  });
  for (Index image = 0; image < l.images; ++image)
    for (Index g = 0; g < l.groups; ++g) {
      double m = 0, m2 = 0, count = 0;
      for (Index b = 0; b < l.blocks(); ++b)
        for (Index c = g * l.width(); c < (g + 1) * l.width(); ++c) {
          const Index at = (image * l.blocks() + b) * l.channels + c;
          const double add = static_cast<double>(std::min(l.block(), l.pixels - b * l.block()));
          const double delta = chunk_mean[at] - m;
          m += delta * add / (count + add);
          m2 += chunk_m2[at] + delta * delta * count * add / (count + add);
          count += add;
        }
      mean[image * l.groups + g] = m;
      variance[image * l.groups + g] = count > 0 ? m2 / count : 0;
    }
}

// With xh = (x - mean) rstd, y = gamma xh + beta and g = dy where the ReLU lets it through:
//   dbeta = sum g,   dgamma = sum g xh,   and with n elements in a group, d = gamma g
//   dx = rstd (d - sum(d) / n - xh sum(d xh) / n)      (sums over the group; the last two only if not fixed)
// Chunks own their pixels of dx; sums are stored per chunk and added in order.
template <class T>
void norm_backward(const NormLayout& l, Var<T> x, Var<T> gamma, Var<T> beta, const Affine<T>& a,
                   const double* rstd, const double* off, bool fixed, const T* dy) {
  Tape<T>& tape = x.tape();
  const Index rows = l.images * l.channels, n = l.blocks() * rows;
  auto *sums = tape.template scratch<double>(n), *mixed = tape.template scratch<double>(n);
  const auto part = [&](Index image) {
    const Index k = image * l.channels;
    return Affine<T>{a.mean + k, a.gain + k, a.shift + k, a.relu};
  };
  const auto sum = FIELDMARK_KERNEL(norm_sums<T>);
  for_blocks(l, [&](Index image, Index chunk, Index at, Index pixels) {
    const Index k = chunk * l.channels;
    sum(x.value() + at, dy + at, pixels, l.channels, part(image), sums + k, mixed + k);
  });
  T *offset = tape.scratch(rows), *slope = tape.scratch(rows), *dgamma = gamma.grad_acc(),
    *dbeta = beta.grad_acc();
  for (Index image = 0; image < l.images; ++image)
    for (Index g = 0; g < l.groups; ++g) {
      const double r = rstd[image * l.groups + g];
      double all = 0, all_xh = 0;
      for (Index c = g * l.width(); c < (g + 1) * l.width(); ++c) {
        const Index first = image * l.blocks() * l.channels;
        const double s = detail::channel_total(sums + first, l.blocks(), l.channels, c),
                     m = detail::channel_total(mixed + first, l.blocks(), l.channels, c),
                     s_xh = r * (m + off[image * l.channels + c] * s);
        if (dgamma) dgamma[c] += static_cast<T>(s_xh);
        if (dbeta) dbeta[c] += static_cast<T>(s);
        all += static_cast<double>(gamma.value()[c]) * s;
        all_xh += static_cast<double>(gamma.value()[c]) * s_xh;
      }
      for (Index c = g * l.width(); c < (g + 1) * l.width(); ++c) {
        const Index k = image * l.channels + c;
        const double steep = fixed ? 0 : r * r * all_xh / l.count();
        slope[k] = static_cast<T>(steep);
        offset[k] = static_cast<T>(fixed ? 0 : r * all / l.count() + off[k] * steep);
      }
    }
  bool fresh = false;
  T* dx = x.grad_acc(&fresh);
  if (!dx) return;
  const auto backward = FIELDMARK_KERNEL(norm_gradient<T>);
  for_blocks(l, [&](Index image, Index, Index at, Index pixels) {
    const Index k = image * l.channels;
    backward(x.value() + at, dy + at, dx + at, pixels, l.channels, part(image), offset + k, slope + k,
             !fresh);
  });
}

// Forward with given statistics, and the backward. `fixed`: the statistics do not depend on x.
template <class T>
Var<T> apply_norm(const NormLayout& l, Var<T> x, Var<T> gamma, Var<T> beta, const double* mean,
                  const double* variance, double eps, bool relu, bool fixed) {
  Tape<T>& tape = x.tape();
  const Index rows = l.images * l.channels;
  T *m = tape.scratch(rows), *gain = tape.scratch(rows), *shift = tape.scratch(rows);
  auto *rstd = tape.template scratch<double>(l.images * l.groups), *off = tape.template scratch<double>(rows);
  for (Index i = 0; i < l.images * l.groups; ++i) rstd[i] = 1 / std::sqrt(variance[i] + eps);
  for (Index i = 0; i < rows; ++i) {
    const Index c = i % l.channels, g = i / l.channels * l.groups + c / l.width();
    const double a = rstd[g] * static_cast<double>(gamma.value()[c]);
    m[i] = static_cast<T>(mean[g]);
    // The shift compensates for the rounding of the mean to T.
    off[i] = static_cast<double>(m[i]) - mean[g];
    gain[i] = static_cast<T>(a);
    shift[i] = static_cast<T>(static_cast<double>(beta.value()[c]) + off[i] * a);
  }
  T* y = nullptr;
  const Var<T> out = tape.output(x.shape(), &y, {x, gamma, beta});
  const auto forward = FIELDMARK_KERNEL(normalise<T>);
  for_blocks(l, [&](Index image, Index, Index at, Index pixels) {
    const Index k = image * l.channels;
    forward(x.value() + at, y + at, pixels, l.channels, Affine<T>{m + k, gain + k, shift + k, relu});
  });
  tape.on_backward(out, [=](const T* dy) {
    norm_backward(l, x, gamma, beta, Affine<T>{m, gain, shift, relu}, rstd, off, fixed, dy);
  });
  return out;
}

// Checks the shapes of gamma and beta, the rank of x, and eps.
template <class T>
void check_norm(const char* op, Var<T> x, Var<T> gamma, Var<T> beta, double eps) {
  check_rank(op, "x", x.shape(), 4, "[images, height, width, channels]");
  check_rank(op, "gamma", gamma.shape(), 1, "[channels]");
  check_extent(op, "gamma", gamma.shape(), 0, x.shape()[3], "channels of x");
  check_rank(op, "beta", beta.shape(), 1, "[channels]");
  check_extent(op, "beta", beta.shape(), 0, x.shape()[3], "channels of x");
  check_number(op, "eps", eps, eps > 0, "above 0");
}

}  // namespace fieldmark::kernels
