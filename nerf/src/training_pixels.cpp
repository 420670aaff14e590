#include "training_pixels.h"
#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace fieldmark::nerf {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

// Which of n entries lie within `margin` of a set one.
void dilate(const std::uint8_t* in, Index n, Index stride, Index margin, std::uint8_t* out) {
  Index last = -margin - 1;
  for (Index i = 0; i < n; ++i) {
    if (in[i * stride]) last = i;
    out[i * stride] = i - last <= margin;
  }
  last = n + margin;
  for (Index i = n - 1; i >= 0; --i) {
    if (in[i * stride]) last = i;
    out[i * stride] |= last - i <= margin;
  }
}

std::vector<std::uint8_t> near_alpha(const View& view, Index margin) {
  const Index h = view.camera.height, w = view.camera.width;
  std::vector<std::uint8_t> mask(at(h * w)), rows(at(h * w));
  for (Index p = 0; p < h * w; ++p) mask[at(p)] = view.rgba[4 * p + 3] > 0;
  for (Index y = 0; y < h; ++y) dilate(&mask[at(y * w)], w, 1, margin, &rows[at(y * w)]);
  for (Index x = 0; x < w; ++x) dilate(&rows[at(x)], h, w, margin, &mask[at(x)]);
  return mask;
}

}  // namespace

Index hull_margin(std::span<const View> views, const Bounds& bounds, Index resolution) {
  const double diagonal = std::sqrt(3.0) * bounds.side / static_cast<double>(resolution);
  double widest = 0;
  for (const View& v : views) {
    double square = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const double p = v.camera.position()[a], low = bounds.corner[a], high = low + bounds.side;
      const double outside = p < low ? low - p : p > high ? p - high : 0;
      square += outside * outside;
    }
    const double nearest = std::max(std::sqrt(square), diagonal);
    widest = std::max(widest, std::max(v.camera.fx, v.camera.fy) * diagonal / nearest);
  }
  return static_cast<Index>(std::ceil(widest)) + 4;
}

std::vector<std::uint32_t> training_pixels(std::span<const View> views, Index margin) {
  if (margin < 0)
    throw ValueError("[training_pixels] margin must not be negative, got " + std::to_string(margin));
  const Index count = static_cast<Index>(views.size());
  const Index size = count > 0 ? views[0].camera.height * views[0].camera.width : 0;
  if (count * size > Index{std::numeric_limits<std::uint32_t>::max()})
    throw ValueError("[training_pixels] views must have at most 2^32 - 1 pixels together, got " +
                     std::to_string(count * size));
  std::vector<std::vector<std::uint32_t>> of_view(at(count));
  parallel_for(count, 1, [&](Index v, Index) {
    const auto mask = near_alpha(views[at(v)], margin);
    for (Index p = 0; p < size; ++p)
      if (mask[at(p)]) of_view[at(v)].push_back(static_cast<std::uint32_t>(v * size + p));
  });
  std::vector<std::uint32_t> all;
  for (const auto& pixels : of_view) all.insert(all.end(), pixels.begin(), pixels.end());
  return all;
}

}  // namespace fieldmark::nerf
