#include "summed_area.h"
#include <fieldmark/engine/shape_checks.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::watermark {
namespace {

constexpr double kRounding = 1e-9;  // pixels by which a rectangle may exceed the image

}  // namespace

SummedArea::SummedArea(const Tensor<float>& image) {
  check_rank("summed_area", "image", image.shape, 3, "[H, W, C]");
  if (image.size() == 0)
    throw ShapeError("[summed_area] image must have at least one pixel, got shape " + image.shape.str());
  height_ = image.shape[0];
  width_ = image.shape[1];
  channels_ = image.shape[2];
  const Index row = (width_ + 1) * channels_;
  sum_.resize(at((height_ + 1) * row));
  for (Index y = 0; y < height_; ++y)
    for (Index x = 0; x < width_; ++x)
      for (Index c = 0; c < channels_; ++c) {
        const Index i = (y + 1) * row + (x + 1) * channels_ + c;
        sum_[at(i)] = static_cast<double>(image[(y * width_ + x) * channels_ + c]) + sum_[at(i - row)] +
                      sum_[at(i - channels_)] - sum_[at(i - row - channels_)];
      }
}

void SummedArea::means(double left, double top, double wide, double high, Index n,
                       std::span<float> out) const {
  if (n < 1 || static_cast<Index>(out.size()) != n * n * channels_ || !(wide > 0 && high > 0) ||
      !(left >= -kRounding && left + wide <= static_cast<double>(width_) + kRounding) ||
      !(top >= -kRounding && top + high <= static_cast<double>(height_) + kRounding))
    throw ValueError("[summed_area] the rectangle must lie in the image and out hold n x n parts, got " +
                     std::to_string(wide) + " x " + std::to_string(high) + " at " + std::to_string(left) +
                     ", " + std::to_string(top) + " and " + std::to_string(out.size()) + " numbers");
  const Index row = (width_ + 1) * channels_;
  // Lines of corners: the grid line before each, and how far beyond it they lie.
  struct Line {
    Index before;
    double beyond;
  };
  const auto line = [n](Index i, double from, double extent, Index size) {
    const double x = std::clamp(from + extent * static_cast<double>(i) / static_cast<double>(n), 0.0,
                                static_cast<double>(size));
    const Index before = std::min(static_cast<Index>(x), size - 1);
    return Line{before, x - static_cast<double>(before)};
  };
  std::vector<Line> columns;
  for (Index j = 0; j <= n; ++j) columns.push_back(line(j, left, wide, width_));
  const double part = wide * high / static_cast<double>(n * n);
  std::vector<double> above(at((n + 1) * channels_)), below(above.size());
  for (Index i = 0; i <= n; ++i) {
    std::swap(above, below);
    const auto [y, fy] = line(i, top, high, height_);
    for (Index j = 0; j <= n; ++j) {
      const auto [x, fx] = columns[at(j)];
      const double* s = &sum_[at(y * row + x * channels_)];
      for (Index c = 0; c < channels_; ++c, ++s)
        below[at(j * channels_ + c)] = (1 - fy) * ((1 - fx) * s[0] + fx * s[channels_]) +
                                       fy * ((1 - fx) * s[row] + fx * s[row + channels_]);
    }
    if (i == 0) continue;
    for (Index k = 0; k < n * channels_; ++k)
      out[at((i - 1) * n * channels_ + k)] = static_cast<float>(
          (below[at(k + channels_)] - below[at(k)] - above[at(k + channels_)] + above[at(k)]) / part);
  }
}

}  // namespace fieldmark::watermark
