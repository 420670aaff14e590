#include "fieldmark/distort/affine_warp.h"

#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "checks.h"

namespace fieldmark::distort {
namespace {

template <class T>
struct Map {
  T m[6];
  Index height, width, out_height, out_width;

  // Input position of output pixel 0 of row i, plus m[0] and m[3] times the offset of pixel j.
  T column_offset(Index j) const { return static_cast<T>(j) - static_cast<T>(out_width - 1) / 2; }
  T row_offset(Index i) const { return static_cast<T>(i) - static_cast<T>(out_height - 1) / 2; }
  T row_x(Index i) const { return m[1] * row_offset(i) + m[2] + static_cast<T>(width - 1) / 2; }
  T row_y(Index i) const { return m[4] * row_offset(i) + m[5] + static_cast<T>(height - 1) / 2; }
};

template <class T>
Map<T> make_map(const T* m, Index height, Index width, Index out_height, Index out_width) {
  return {{m[0], m[1], m[2], m[3], m[4], m[5]},
          height,
          width,
          out_height > 0 ? out_height : height,
          out_width > 0 ? out_width : width};
}

// The four pixels around a position: element offsets (-1 = background) in the order 00, 01, 10, 11, and
// fractions.
template <class T>
struct Taps {
  Index at[4];
  T fx, fy;
};

// For u > -1, truncation equals the floor up to an offset of one: no function call, and no undefined cast,
// since u is in range.
template <class T>
Index floor_of(T u) {
  const int k = static_cast<int>(u);
  return k - (static_cast<T>(k) > u ? 1 : 0);
}

template <class T>
bool locate(const Map<T>& map, T u, T v, Index channels, Taps<T>& taps) {
  // Written so that a NaN is outside.
  if (!(u > -1 && u < static_cast<T>(map.width) && v > -1 && v < static_cast<T>(map.height))) return false;
  const Index x = floor_of(u), y = floor_of(v);
  taps.fx = u - static_cast<T>(x);
  taps.fy = v - static_cast<T>(y);
  const bool left = x >= 0, right = x + 1 < map.width, top = y >= 0, bottom = y + 1 < map.height;
  const Index first = (y * map.width + x) * channels, row = map.width * channels;
  taps.at[0] = top && left ? first : -1;
  taps.at[1] = top && right ? first + channels : -1;
  taps.at[2] = bottom && left ? first + row : -1;
  taps.at[3] = bottom && right ? first + row + channels : -1;
  return true;
}

// kChannels is fixed for colour and grey images, so that the inner loop is unrolled: twice as fast for 3.
template <int kChannels, class T>
void forward_rows(const Map<T>& map, const T* x, const T* background, Index any_channels, Index begin,
                  Index end, T* y) {
  const Index channels = kChannels ? kChannels : any_channels;
  Taps<T> taps;
  for (Index i = begin; i < end; ++i) {
    const T u0 = map.row_x(i), v0 = map.row_y(i);
    T* out = y + i * map.out_width * channels;
    for (Index j = 0; j < map.out_width; ++j, out += channels) {
      const T dx = map.column_offset(j);
      if (!locate(map, u0 + map.m[0] * dx, v0 + map.m[3] * dx, channels, taps)) {
        for (Index c = 0; c < channels; ++c) out[c] = background[c];
        continue;
      }
      const T* p[4];
      for (int k = 0; k < 4; ++k) p[k] = taps.at[k] < 0 ? background : x + taps.at[k];
      const T w01 = taps.fx * (1 - taps.fy), w00 = (1 - taps.fx) * (1 - taps.fy);
      const T w11 = taps.fx * taps.fy, w10 = (1 - taps.fx) * taps.fy;
      for (Index c = 0; c < channels; ++c)
        out[c] = (w00 * p[0][c] + w01 * p[1][c]) + (w10 * p[2][c] + w11 * p[3][c]);
    }
  }
}

// Scatters dy into dx; taps outside the image write to `sink` [channels]. Single-threaded, because rows of dy
// share rows of dx.
template <int kChannels, class T>
void backward_image(const Map<T>& map, const T* dy, Index any_channels, T* dx, T* sink) {
  const Index channels = kChannels ? kChannels : any_channels;
  Taps<T> taps;
  for (Index i = 0; i < map.out_height; ++i) {
    const T u0 = map.row_x(i), v0 = map.row_y(i);
    const T* g = dy + i * map.out_width * channels;
    for (Index j = 0; j < map.out_width; ++j, g += channels) {
      const T offset = map.column_offset(j);
      if (!locate(map, u0 + map.m[0] * offset, v0 + map.m[3] * offset, channels, taps)) continue;
      T* d[4];
      for (int k = 0; k < 4; ++k) d[k] = taps.at[k] < 0 ? sink : dx + taps.at[k];
      const T w[4] = {(1 - taps.fx) * (1 - taps.fy), taps.fx * (1 - taps.fy), (1 - taps.fx) * taps.fy,
                      taps.fx * taps.fy};
      for (int k = 0; k < 4; ++k)
        for (Index c = 0; c < channels; ++c) d[k][c] += w[k] * g[c];
    }
  }
}

// du, dv of row i summed over its pixels, plain and times the pixel's column offset: {sum du, sum du dx, dv,
// dv dx}.
template <class T>
void backward_row(const Map<T>& map, const T* x, const T* background, const T* dy, Index channels, Index i,
                  double* sums) {
  Taps<T> taps;
  std::fill_n(sums, 4, 0.0);
  const T* g = dy + i * map.out_width * channels;
  for (Index j = 0; j < map.out_width; ++j, g += channels) {
    const T offset = map.column_offset(j);
    if (!locate(map, map.row_x(i) + map.m[0] * offset, map.row_y(i) + map.m[3] * offset, channels, taps))
      continue;
    const T* p[4];
    for (int k = 0; k < 4; ++k) p[k] = taps.at[k] < 0 ? background : x + taps.at[k];
    T du = 0, dv = 0;
    for (Index c = 0; c < channels; ++c) {
      du += g[c] * ((1 - taps.fy) * (p[1][c] - p[0][c]) + taps.fy * (p[3][c] - p[2][c]));
      dv += g[c] * ((1 - taps.fx) * (p[2][c] - p[0][c]) + taps.fx * (p[3][c] - p[1][c]));
    }
    sums[0] += static_cast<double>(du);
    sums[1] += static_cast<double>(du) * static_cast<double>(offset);
    sums[2] += static_cast<double>(dv);
    sums[3] += static_cast<double>(dv) * static_cast<double>(offset);
  }
}

// Rows in a chunk of about 16k elements.
Index rows_per_chunk(Index row) { return 1 + (Index{1} << 14) / std::max<Index>(row, 1); }

}  // namespace

template <class T>
Var<T> affine_warp(Var<T> x, Var<T> matrix, WarpOptions<std::type_identity_t<T>> options) {
  check_image("affine_warp", x.shape());
  check_parameter("affine_warp", "matrix", matrix.shape(), 6);
  const Index channels = x.shape()[2];
  if (!options.background.empty() && static_cast<Index>(options.background.size()) != channels)
    throw ShapeError(
        "[affine_warp] background: must have one element for each channel of x, whose shape is " +
        x.shape().str() + ", got " + std::to_string(options.background.size()));
  const auto map = make_map(matrix.value(), x.shape()[0], x.shape()[1], options.height, options.width);
  Tape<T>& tape = x.tape();
  T* background = tape.scratch(channels);
  std::fill_n(background, channels, T(0));
  std::copy(options.background.begin(), options.background.end(), background);
  T* y = nullptr;
  const Var<T> out = tape.output({map.out_height, map.out_width, channels}, &y, {x, matrix});
  const Index grain = rows_per_chunk(map.out_width * channels);
  parallel_for(map.out_height, grain, [&](Index begin, Index end) {
    (channels == 3 ? forward_rows<3, T> : forward_rows<0, T>)(map, x.value(), background, channels, begin,
                                                              end, y);
  });
  // dx_q = sum_p dy_p dy_p/dx_q, a scatter with the forward's weights. With (u, v) a pixel's input position
  // and d, e its column and row offset: du = m0 d + m1 e + m2, so dm = [sum du d, sum du e, sum du, sum dv d,
  // ..]; e is fixed along a row. Rows own their sums, which are added in order; the scatter is serial.
  tape.on_backward(out, [x, matrix, map, background, channels, grain](const T* dy) {
    if (T* dx = x.grad_acc()) {
      T* sink = x.tape().scratch(channels);
      std::fill_n(sink, channels, T(0));
      (channels == 3 ? backward_image<3, T> : backward_image<0, T>)(map, dy, channels, dx, sink);
    }
    T* dm = matrix.grad_acc();
    if (!dm) return;
    double* rows = x.tape().template scratch<double>(4 * map.out_height);
    parallel_for(map.out_height, grain, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i)
        backward_row(map, x.value(), background, dy, channels, i, rows + 4 * i);
    });
    double sums[6] = {};
    for (Index i = 0; i < map.out_height; ++i) {
      const double e = static_cast<double>(map.row_offset(i));
      for (int k = 0; k < 2; ++k) {
        sums[3 * k] += rows[4 * i + 2 * k + 1];
        sums[3 * k + 1] += rows[4 * i + 2 * k] * e;
        sums[3 * k + 2] += rows[4 * i + 2 * k];
      }
    }
    for (int k = 0; k < 6; ++k) dm[k] += static_cast<T>(sums[k]);
  });
  return out;
}

Tensor<std::int32_t> warp_labels(const Tensor<std::int32_t>& labels, std::span<const float> matrix,
                                 std::int32_t background, Index height, Index width) {
  check_rank("warp_labels", "labels", labels.shape, 2, "[height, width]");
  if (matrix.size() != 6)
    throw ShapeError("[warp_labels] matrix: must have 6 elements, got " + std::to_string(matrix.size()));
  const auto map = make_map(matrix.data(), labels.shape[0], labels.shape[1], height, width);
  Tensor<std::int32_t> out({map.out_height, map.out_width}, background);
  parallel_for(map.out_height, rows_per_chunk(map.out_width), [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      // With half a pixel added, the floor is the nearest pixel.
      const float u0 = map.row_x(i) + 0.5f, v0 = map.row_y(i) + 0.5f;
      for (Index j = 0; j < map.out_width; ++j) {
        const float u = u0 + map.m[0] * map.column_offset(j), v = v0 + map.m[3] * map.column_offset(j);
        if (!(u >= 0 && u < static_cast<float>(map.width) && v >= 0 && v < static_cast<float>(map.height)))
          continue;
        out[i * map.out_width + j] = labels[floor_of(v) * map.width + floor_of(u)];
      }
    }
  });
  return out;
}

template Var<float> affine_warp(Var<float>, Var<float>, WarpOptions<float>);
template Var<double> affine_warp(Var<double>, Var<double>, WarpOptions<double>);

}  // namespace fieldmark::distort
