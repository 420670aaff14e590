#pragma once
#include <fieldmark/engine/safetensors.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "support/worst.h"

/// The networks of the papers as plain loops in double over channels-first images. They share only the file
/// reader with the library.
struct PlainImage {
  long c = 0, h = 0, w = 0;
  std::vector<double> x;
  double& at(long k, long i, long j) { return x[static_cast<std::size_t>((k * h + i) * w + j)]; }
  double at(long k, long i, long j) const { return x[static_cast<std::size_t>((k * h + i) * w + j)]; }
};

inline PlainImage plain_image(long c, long h, long w) {
  return {c, h, w, std::vector<double>(static_cast<std::size_t>(c * h * w))};
}

/// Computes relu(conv2d) with weights in PyTorch's layout [out, in, k, k].
inline PlainImage plain_conv(const PlainImage& x, const fieldmark::SafetensorsFile& file,
                             const std::string& name, long stride, long padding) {
  const auto w = file.f32(name + ".weight"), b = file.f32(name + ".bias");
  const long k = w.shape[2];
  PlainImage y =
      plain_image(w.shape[0], (x.h + 2 * padding - k) / stride + 1, (x.w + 2 * padding - k) / stride + 1);
  for (long o = 0; o < y.c; ++o)
    for (long i = 0; i < y.h; ++i)
      for (long j = 0; j < y.w; ++j) {
        double sum = static_cast<double>(b[o]);
        for (long c = 0; c < x.c; ++c)
          for (long u = 0; u < k; ++u)
            for (long v = 0; v < k; ++v) {
              const long r = i * stride + u - padding, s = j * stride + v - padding;
              if (r >= 0 && r < x.h && s >= 0 && s < x.w)
                sum += static_cast<double>(w[((o * x.c + c) * k + u) * k + v]) * x.at(c, r, s);
            }
        y.at(o, i, j) = std::max(sum, 0.0);
      }
  return y;
}

/// Max pooling; `ceil` is PyTorch's ceil_mode.
inline PlainImage plain_max_pool(const PlainImage& x, long size, long stride, bool ceil) {
  const auto extent = [&](long n) {
    const double windows = static_cast<double>(n - size) / static_cast<double>(stride);
    return static_cast<long>(ceil ? std::ceil(windows) : std::floor(windows)) + 1;
  };
  PlainImage y = plain_image(x.c, extent(x.h), extent(x.w));
  for (long c = 0; c < y.c; ++c)
    for (long i = 0; i < y.h; ++i)
      for (long j = 0; j < y.w; ++j) {
        double most = -1e300;
        for (long u = i * stride; u < std::min(i * stride + size, x.h); ++u)
          for (long v = j * stride; v < std::min(j * stride + size, x.w); ++v)
            most = std::max(most, x.at(c, u, v));
        y.at(c, i, j) = most;
      }
  return y;
}

/// Concatenates the channels of a and b.
inline PlainImage plain_concat(PlainImage a, const PlainImage& b) {
  a.c += b.c;
  a.x.insert(a.x.end(), b.x.begin(), b.x.end());
  return a;
}

/// Returns the largest difference relative to the largest magnitude. @param y  [1, H, W, C] of the library
template <class T>
double plain_error(const PlainImage& want, const T* y) {
  double off = 0, most = 1e-30;
  for (long c = 0; c < want.c; ++c)
    for (long p = 0; p < want.h * want.w; ++p) {
      const double w = want.x[static_cast<std::size_t>(c * want.h * want.w + p)];
      const double d = std::abs(static_cast<double>(y[p * want.c + c]) - w);
      raise_to(off, d);
      raise_to(most, std::abs(w));
    }
  return off / most;
}
