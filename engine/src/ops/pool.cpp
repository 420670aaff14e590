#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/shape_checks.h>

#include <algorithm>
#include <limits>
#include <string>

#include "kernels/pool.h"
#include "ops/chunks.h"
#include "ops/window_checks.h"

namespace fieldmark {
namespace kernels {
namespace {

template <class T>
Var<T> avg_pool(Var<T> x, Index size) {
  const Shape s = x.shape();
  const Index height = s[1] / size, width = s[2] / size, row = s[2] * s[3];
  const PoolRow p{width, size, s[3], row};
  T* y = nullptr;
  const Var<T> out = x.tape().output({s[0], height, width, s[3]}, &y, {x});
  const Index grain = detail::row_grain(std::min(size, s[1]) * row);
  const auto forward = FIELDMARK_KERNEL(pool_row<T>);
  parallel_for(s[0] * height, grain, [&](Index r0, Index r1) {
    for (Index r = r0; r < r1; ++r)
      forward(p, x.value() + (r / height * s[1] + r % height * size) * row, y + r * width * s[3]);
  });

  // Each pixel of a window receives dy / size^2, every other pixel 0. A chunk owns its rows of windows.
  x.tape().on_backward(out, [=](const T* dy) {
    bool fresh = false;
    T* dx = x.grad_acc(&fresh);
    const auto backward = FIELDMARK_KERNEL(pool_row_backward<T>);
    parallel_for(s[0] * height, grain, [&](Index r0, Index r1) {
      for (Index r = r0; r < r1; ++r)
        backward(p, dy + r * width * s[3], dx + (r / height * s[1] + r % height * size) * row, !fresh);
    });
    if (!fresh) return;
    for (Index n = 0; n < s[0]; ++n)
      std::fill(dx + (n * s[1] + height * size) * row, dx + (n + 1) * s[1] * row, T(0));
  });
  return out;
}

template <class T>
Var<T> global_avg_pool(Var<T> x) {
  const Shape s = x.shape();
  const Index pixels = s[1] * s[2], channels = s[3];
  const Index block = detail::row_grain(channels), blocks = (pixels + block - 1) / block;
  T* y = nullptr;
  Tape<T>& tape = x.tape();
  const Var<T> out = tape.output({s[0], channels}, &y, {x});
  auto* sums = tape.template scratch<double>(s[0] * blocks * channels);
  const auto add = FIELDMARK_KERNEL(channel_sums<T>);
  detail::for_image_chunks(s[0], pixels, block, [&](Index n, Index first, Index count) {
    add(x.value() + (n * pixels + first) * channels, nullptr, count, channels,
        sums + (n * blocks + first / block) * channels);
  });
  for (Index i = 0; i < s[0] * channels; ++i)
    y[i] = static_cast<T>(
        detail::channel_total(sums + i / channels * blocks * channels, blocks, channels, i % channels) /
        static_cast<double>(pixels));

  // Every pixel receives dy / pixels. A chunk owns its pixels.
  tape.on_backward(out, [=](const T* dy) {
    bool fresh = false;
    T *dx = x.grad_acc(&fresh), *share = x.tape().scratch(s[0] * channels);
    for (Index i = 0; i < s[0] * channels; ++i) share[i] = dy[i] / static_cast<T>(pixels);
    const auto fill = FIELDMARK_KERNEL(fill_pixels<T>);
    detail::for_image_chunks(s[0], pixels, block, [&](Index n, Index first, Index count) {
      fill(share + n * channels, count, channels, dx + (n * pixels + first) * channels, !fresh);
    });
  });
  return out;
}

Index windows_along(Index extent, const MaxPool& m) {
  if (extent < (m.ceil_mode ? 1 : m.size)) return 0;
  const Index last = std::max<Index>(0, extent - m.size);
  const Index count = (m.ceil_mode ? last + m.stride - 1 : last) / m.stride + 1;
  return (count - 1) * m.stride < extent ? count : count - 1;
}

template <class T>
Var<T> max_pool(Var<T> x, const MaxPool& m) {
  const Shape s = x.shape();
  const Index height = windows_along(s[1], m), width = windows_along(s[2], m), line = s[2] * s[3];
  const Index out_line = width * s[3], grain = detail::row_grain(m.size * line);
  const MaxPoolRow p{width, m.size, m.stride, m.size, s[2], s[3]};
  Tape<T>& tape = x.tape();
  T* y = nullptr;
  const Var<T> out = tape.output({s[0], height, width, s[3]}, &y, {x});
  T* place = x.needs_grad() ? tape.scratch(s[0] * height * out_line) : nullptr;
  const auto forward = FIELDMARK_KERNEL(max_pool_row<T>);
  parallel_for(s[0] * height, grain, [&](Index r0, Index r1) {
    for (Index r = r0; r < r1; ++r) {
      const Index top = r % height * m.stride;
      MaxPoolRow row = p;
      row.rows = std::min(m.size, s[1] - top);
      forward(row, x.value() + (r / height * s[1] + top) * line, y + r * out_line,
              place ? place + r * out_line : nullptr);
    }
  });

  // The largest pixel of a window receives its dy. A chunk owns rows of x and gathers from every row of
  // windows that covers them, in order.
  tape.on_backward(out, [=](const T* dy) {
    bool fresh = false;
    T* dx = x.grad_acc(&fresh);
    const auto backward = FIELDMARK_KERNEL(max_pool_row_backward<T>);
    parallel_for(s[0] * s[1], detail::row_grain(line), [&](Index r0, Index r1) {
      for (Index r = r0; r < r1; ++r) {
        const Index n = r / s[1], i = r % s[1];
        if (fresh) std::fill_n(dx + r * line, line, T(0));
        const Index first = i < m.size ? 0 : (i - m.size) / m.stride + 1;
        for (Index w = first; w < height && w * m.stride <= i; ++w) {
          const Index at = (n * height + w) * out_line;
          backward(p, i - w * m.stride, dy + at, place + at, dx + r * line);
        }
      }
    });
  });
  return out;
}

}  // namespace
}  // namespace kernels
namespace {

// The kernel numbers a window's pixels in T, which is exact to 2^24 in float.
template <class T>
void check_numbering(Index size, const Shape& x) {
  constexpr Index kMost = Index{1} << std::numeric_limits<T>::digits;
  const Index height = std::min(size, x[1]), width = std::min(size, x[2]);
  if (height > kMost / std::max<Index>(1, width))
    throw ValueError("[max_pool] size must leave at most " + std::to_string(kMost) +
                     " pixels of x in a window, got " + std::to_string(height) + " x " +
                     std::to_string(width) + " for shape " + x.str());
}

}  // namespace

template <class T>
Var<T> avg_pool(Var<T> x, Index size) {
  check_rank("avg_pool", "x", x.shape(), 4, "[images, height, width, channels]");
  detail::check_step("avg_pool", "size", size, 1);
  return kernels::avg_pool(x, size);
}

template <class T>
Var<T> global_avg_pool(Var<T> x) {
  check_rank("global_avg_pool", "x", x.shape(), 4, "[images, height, width, channels]");
  if (x.shape()[1] < 1 || x.shape()[2] < 1)
    throw ShapeError("[global_avg_pool] x must have at least one pixel, got shape " + x.shape().str());
  return kernels::global_avg_pool(x);
}

template <class T>
Var<T> max_pool(Var<T> x, MaxPool windows) {
  check_rank("max_pool", "x", x.shape(), 4, "[images, height, width, channels]");
  detail::check_step("max_pool", "size", windows.size, 1);
  detail::check_step("max_pool", "stride", windows.stride, 1);
  const Index least = windows.ceil_mode ? 1 : windows.size;
  if (std::min(x.shape()[1], x.shape()[2]) < least)
    throw ShapeError("[max_pool] x: height and width must be at least " + std::to_string(least) +
                     " (one window), got shape " + x.shape().str());
  check_numbering<T>(windows.size, x.shape());
  // A larger window sees no more.
  windows.size = std::min(windows.size, std::max(x.shape()[1], x.shape()[2]));
  return kernels::max_pool(x, windows);
}

template Var<float> avg_pool(Var<float>, Index);
template Var<double> avg_pool(Var<double>, Index);
template Var<float> global_avg_pool(Var<float>);
template Var<double> global_avg_pool(Var<double>);
template Var<float> max_pool(Var<float>, MaxPool);
template Var<double> max_pool(Var<double>, MaxPool);

}  // namespace fieldmark
