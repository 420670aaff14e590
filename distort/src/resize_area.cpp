#include "fieldmark/distort/resize_area.h"

#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>

#include <algorithm>

#include "checks.h"
#include "kernels/weighted_taps.h"

namespace fieldmark::distort {
namespace {

// For each of the n cells of an axis, the overlapping cells of the other axis: indices at[start[i] .. start[i
// + 1]) and their weights.
template <class T>
struct Overlaps {
  const Index *start, *at;
  const T* weight;
};

// Lengths are in units of which the axis has n * m: one of n cells has length m, one of m cells length n. The
// weight is the overlap over the length of a pixel of the resized axis, so that the transposed table has the
// same values.
template <class T>
Overlaps<T> overlaps(Tape<T>& tape, Index n, Index m, Index length, Index stride) {
  auto* start = tape.template scratch<Index>(n + 1);
  auto* at = tape.template scratch<Index>(n + m);
  T* weight = tape.scratch(n + m);
  Index k = 0;
  for (Index i = 0; i < n; ++i) {
    start[i] = k;
    for (Index r = i * m / n; r < m && r * n < (i + 1) * m; ++r, ++k) {
      at[k] = r * stride;
      const Index overlap = std::min((i + 1) * m, (r + 1) * n) - std::max(i * m, r * n);
      weight[k] = static_cast<T>(overlap) / static_cast<T>(length);
    }
  }
  start[n] = k;
  return {start, at, weight};
}

// y [rows, row] (+)= table * x, rows of `row` elements.
template <class T>
void apply_rows(const Overlaps<T>& table, const T* x, Index rows, Index row, T* y, bool add) {
  parallel_for(rows, 1 + (Index{1} << 14) / std::max<Index>(row, 1), [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i)
      kernels::weighted_taps(y + i * row, x, table.at + table.start[i], table.weight + table.start[i],
                             table.start[i + 1] - table.start[i], row, add);
  });
}

// y [rows, n, channels] = x [rows, row] with the table along the second axis.
template <class T>
void apply_columns(const Overlaps<T>& table, const T* x, Index rows, Index row, Index n, Index channels,
                   T* y) {
  parallel_for(rows, 1 + (Index{1} << 14) / std::max<Index>(row, 1), [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      T* out = y + i * n * channels;
      for (Index j = 0; j < n; ++j, out += channels) {
        std::fill_n(out, channels, T(0));
        for (Index k = table.start[j]; k < table.start[j + 1]; ++k) {
          const T* p = x + i * row + table.at[k];
          for (Index c = 0; c < channels; ++c) out[c] += table.weight[k] * p[c];
        }
      }
    }
  });
}

void check_size(const Shape& x, Index height, Index width, const char* op) {
  if (x[0] < 1 || x[1] < 1)
    throw ShapeError("[" + std::string(op) + "] x: must have at least one pixel, got shape " + x.str());
  if (height < 1 || width < 1)
    throw ValueError("[" + std::string(op) + "] height and width: must be at least 1, got " +
                     std::to_string(height) + " and " + std::to_string(width));
}

}  // namespace

template <class T>
Var<T> resize_area(Var<T> x, Index height, Index width) {
  check_image("resize_area", x.shape());
  check_size(x.shape(), height, width, "resize_area");
  const Index h = x.shape()[0], w = x.shape()[1], c = x.shape()[2];
  Tape<T>& tape = x.tape();
  T* y = nullptr;
  const Var<T> out = tape.output({height, width, c}, &y, {x});
  T* half = tape.scratch(height * w * c);
  apply_rows(overlaps(tape, height, h, h, w * c), x.value(), height, w * c, half, false);
  apply_columns(overlaps(tape, width, w, w, c), half, height, w * c, width, c, y);
  // Linear: dx = a^T dy b. The transposed tables also gather, so every row has one owner.
  tape.on_backward(out, [x, half, height, width, h, w, c](const T* dy) {
    Tape<T>& t = x.tape();
    bool fresh = false;
    T* dx = x.grad_acc(&fresh);
    apply_columns(overlaps(t, w, width, w, c), dy, height, width * c, w, c, half);
    apply_rows(overlaps(t, h, height, h, w * c), half, h, w * c, dx, !fresh);
  });
  return out;
}

Tensor<std::int32_t> resize_labels(const Tensor<std::int32_t>& labels, Index height, Index width) {
  check_rank("resize_labels", "labels", labels.shape, 2, "[height, width]");
  check_size(labels.shape, height, width, "resize_labels");
  const Index h = labels.shape[0], w = labels.shape[1];
  Tensor<std::int32_t> out({height, width});
  for (Index i = 0; i < height; ++i)
    for (Index j = 0; j < width; ++j)
      out[i * width + j] = labels[(2 * i + 1) * h / (2 * height) * w + (2 * j + 1) * w / (2 * width)];
  return out;
}

template Var<float> resize_area(Var<float>, Index, Index);
template Var<double> resize_area(Var<double>, Index, Index);

}  // namespace fieldmark::distort
