#include <fieldmark/engine/ops/resample.h>
#include <fieldmark/engine/shape_checks.h>

#include <cmath>

#include "ops/chunks.h"
#include "ops/elementwise.h"

namespace fieldmark {
namespace {

// Output position = (1 - weight) input[lo] + weight input[hi].
template <class T>
struct Tap {
  Index lo, hi;
  T weight;
};

template <class T>
Tap<T>* make_taps(Tape<T>& tape, Index in, Index out, Interpolation mode) {
  auto* taps = tape.template scratch<Tap<T>>(out);
  for (Index i = 0; i < out; ++i) {
    const double edge = (static_cast<double>(i) + 0.5) * static_cast<double>(in) / static_cast<double>(out);
    if (mode == Interpolation::nearest) {
      const Index at = std::min(in - 1, static_cast<Index>(edge));
      taps[i] = {at, at, T(0)};
    } else {
      const double u = std::clamp(edge - 0.5, 0.0, static_cast<double>(in - 1));
      const Index lo = static_cast<Index>(u);
      taps[i] = {lo, std::min(lo + 1, in - 1), static_cast<T>(u - static_cast<double>(lo))};
    }
  }
  return taps;
}

// Returns the weight of input line i in output line t.
template <class T>
T share(const Tap<T>& t, Index i) {
  return (t.lo == i ? 1 - t.weight : T(0)) + (t.hi == i ? t.weight : T(0));
}

template <class T>
void resample_row(const Tap<T>* across, Index width, Index channels, T wy, const T* top, const T* bottom,
                  T* y) {
  for (Index j = 0; j < width; ++j, y += channels) {
    const T wx = across[j].weight;
    const T *a = top + across[j].lo * channels, *b = top + across[j].hi * channels;
    if (wx == 0 && wy == 0) {
      std::copy_n(a, channels, y);
      continue;
    }
    const T *c = bottom + across[j].lo * channels, *d = bottom + across[j].hi * channels;
    for (Index k = 0; k < channels; ++k)
      y[k] = (1 - wy) * ((1 - wx) * a[k] + wx * b[k]) + wy * ((1 - wx) * c[k] + wx * d[k]);
  }
}

// dx[lo] += w (1 - wx) dy, dx[hi] += w wx dy along one row.
template <class T>
void add_row(const Tap<T>* across, Index width, Index channels, T w, const T* dy, T* dx) {
  for (Index j = 0; j < width; ++j, dy += channels) {
    const T right = w * across[j].weight, left = w - right;
    const detail::In<T> d(dy, channels);
    detail::Out<T>(dx + across[j].lo * channels, channels) += left * d;
    if (right != 0) detail::Out<T>(dx + across[j].hi * channels, channels) += right * d;
  }
}

}  // namespace

template <class T>
Var<T> upsample_to(Var<T> x, Index height, Index width, Interpolation mode) {
  check_rank("upsample_to", "x", x.shape(), 4, "[images, height, width, channels]");
  if (height < 0 || width < 0)
    throw ValueError("[upsample_to] height and width must be 0 or more, got " + std::to_string(height) +
                     " and " + std::to_string(width));
  const Shape s = x.shape();
  if (s[1] * s[2] == 0 && height * width > 0)
    throw ShapeError("[upsample_to] x must have at least one pixel, got shape " + s.str());
  const Index channels = s[3], row = s[2] * channels, out_row = width * channels;
  const Tap<T>*down = make_taps(x.tape(), s[1], height, mode),
        *across = make_taps(x.tape(), s[2], width, mode);
  T* y = nullptr;
  const Var<T> out = x.tape().output({s[0], height, width, channels}, &y, {x});
  parallel_for(s[0] * height, detail::row_grain(out_row), [&](Index r0, Index r1) {
    for (Index r = r0; r < r1; ++r) {
      const Tap<T>& t = down[r % height];
      const T* image = x.value() + r / height * s[1] * row;
      resample_row(across, width, channels, t.weight, image + t.lo * row, image + t.hi * row,
                   y + r * out_row);
    }
  });

  // The transpose of the same weights. A chunk owns rows of dx and visits the output rows that read them, in
  // order: taps grow with i, so those rows are contiguous.
  x.tape().on_backward(out, [=](const T* dy) {
    bool fresh = false;
    T* dx = x.grad_acc(&fresh);
    parallel_for(s[0] * s[1], detail::row_grain(out_row), [&](Index r0, Index r1) {
      if (fresh) std::fill(dx + r0 * row, dx + r1 * row, T(0));
      for (Index r = r0; r < r1; ++r) {
        const Index i = r % s[1], n = r / s[1];
        const auto* t =
            std::partition_point(down, down + height, [i](const Tap<T>& tap) { return tap.hi < i; });
        for (; t != down + height && t->lo <= i; ++t)
          if (const T w = share(*t, i); w != 0)
            add_row(across, width, channels, w, dy + (n * height + (t - down)) * out_row, dx + r * row);
      }
    });
  });
  return out;
}

template <class T>
Var<T> upsample_nearest(Var<T> x, Index factor) {
  check_rank("upsample_nearest", "x", x.shape(), 4, "[images, height, width, channels]");
  if (factor < 1)
    throw ValueError("[upsample_nearest] factor must be at least 1, got " + std::to_string(factor));
  return upsample_to(x, x.shape()[1] * factor, x.shape()[2] * factor, Interpolation::nearest);
}

template <class T>
Var<T> space_to_depth(Var<T> x) {
  check_rank("space_to_depth", "x", x.shape(), 4, "[images, height, width, channels]");
  const Shape s = x.shape();
  if (s[1] % 2 != 0 || s[2] % 2 != 0)
    throw ShapeError("[space_to_depth] x must have an even height and width, got shape " + s.str());
  const Index width = s[2] / 2, pair = 2 * s[3];  // two neighbours of a row are adjacent in both layouts
  T* y = nullptr;
  const Var<T> out = x.tape().output({s[0], s[1] / 2, width, 4 * s[3]}, &y, {x});
  parallel_for(s[0] * s[1], detail::row_grain(width * pair), [&](Index r0, Index r1) {
    for (Index r = r0; r < r1; ++r)
      for (Index j = 0; j < width; ++j)
        std::copy_n(x.value() + (r * width + j) * pair, pair, y + ((r / 2 * width + j) * 2 + r % 2) * pair);
  });

  // A permutation: dx reads dy at the same positions. A chunk owns its rows of dx.
  x.tape().on_backward(out, [=](const T* dy) {
    T* dx = x.grad_acc();
    parallel_for(s[0] * s[1], detail::row_grain(width * pair), [&](Index r0, Index r1) {
      for (Index r = r0; r < r1; ++r)
        for (Index j = 0; j < width; ++j)
          for (Index k = 0; k < pair; ++k)
            dx[(r * width + j) * pair + k] += dy[((r / 2 * width + j) * 2 + r % 2) * pair + k];
    });
  });
  return out;
}

template Var<float> upsample_nearest(Var<float>, Index);
template Var<double> upsample_nearest(Var<double>, Index);
template Var<float> upsample_to(Var<float>, Index, Index, Interpolation);
template Var<double> upsample_to(Var<double>, Index, Index, Interpolation);
template Var<float> space_to_depth(Var<float>);
template Var<double> space_to_depth(Var<double>);

}  // namespace fieldmark
