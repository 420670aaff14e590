#include "silhouettes.h"

#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "checks.h"

namespace fieldmark::nerf {

bool is_valid(const View& v, Index pixel) { return v.valid.empty() || v.valid[at(pixel)] != 0; }

namespace {

// Returns true if the scene may be behind a pixel; a mask may hide it.
bool may_show(const View& v, Index pixel) { return v.rgba[4 * pixel + 3] > 0 || !is_valid(v, pixel); }

// Counts of pixels that may show the scene, left of and above each, so that four lookups test any rectangle.
struct Coverage {
  Camera camera;
  Index width, height;
  std::vector<std::int32_t> sum;  // [height + 1, width + 1]

  explicit Coverage(const View& v) : camera(v.camera), width(v.rgba.shape[1]), height(v.rgba.shape[0]) {
    sum.assign(at((width + 1) * (height + 1)), 0);
    for (Index y = 0; y < height; ++y)
      for (Index x = 0; x < width; ++x)
        sum[at((y + 1) * (width + 1) + x + 1)] =
            sum[at(y * (width + 1) + x + 1)] + sum[at((y + 1) * (width + 1) + x)] -
            sum[at(y * (width + 1) + x)] + (may_show(v, y * width + x) ? 1 : 0);
  }

  bool may_contain(const double p[3], double radius) const {
    const Pose& m = camera.pose;
    const double d[3] = {p[0] - m[3], p[1] - m[7], p[2] - m[11]};
    const double x = m[0] * d[0] + m[4] * d[1] + m[8] * d[2], y = m[1] * d[0] + m[5] * d[1] + m[9] * d[2];
    const double depth = -(m[2] * d[0] + m[6] * d[1] + m[10] * d[2]);
    if (depth <= radius) return true;
    // The ball's nearest point bounds its size in the image; adds one pixel for the image's own sampling.
    const double r = std::max(camera.fx, camera.fy) * radius / (depth - radius) + 1;
    const double u = camera.cx + camera.fx * x / depth, v = camera.cy - camera.fy * y / depth;
    const auto u0 = static_cast<Index>(std::floor(u - r)), u1 = static_cast<Index>(std::ceil(u + r));
    const auto v0 = static_cast<Index>(std::floor(v - r)), v1 = static_cast<Index>(std::ceil(v + r));
    if (u0 < 0 || v0 < 0 || u1 > width || v1 > height) return true;
    const Index row = width + 1;
    return sum[at(v1 * row + u1)] - sum[at(v0 * row + u1)] - sum[at(v1 * row + u0)] + sum[at(v0 * row + u0)] >
           0;
  }
};

// Returns true if no view rules out the cube of `cells` cells at integer position (x, y, z).
bool stays(const std::vector<Coverage>& views, const Bounds& b, double cell, Index cells, Index x, Index y,
           Index z) {
  const double half = 0.5 * static_cast<double>(cells);
  const double p[3] = {b.corner[0] + (static_cast<double>(x) + half) * cell,
                       b.corner[1] + (static_cast<double>(y) + half) * cell,
                       b.corner[2] + (static_cast<double>(z) + half) * cell};
  const double radius = half * cell * std::sqrt(3.0);
  return std::all_of(views.begin(), views.end(), [&](const Coverage& v) { return v.may_contain(p, radius); });
}

// Marks the entries within `margin` of a set one.
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
  for (Index p = 0; p < h * w; ++p) mask[at(p)] = may_show(view, p);
  for (Index y = 0; y < h; ++y) dilate(&mask[at(y * w)], w, 1, margin, &rows[at(y * w)]);
  for (Index x = 0; x < w; ++x) dilate(&rows[at(x)], h, w, margin, &mask[at(x)]);
  return mask;
}

}  // namespace

std::vector<std::uint8_t> visual_hull(std::span<const View> views, const Bounds& bounds, Index resolution) {
  if (resolution < 4 || resolution > 512 || resolution % 4 != 0)
    throw ValueError("[visual_hull] resolution must be a multiple of 4 from 4 to 512, got " +
                     std::to_string(resolution));
  std::vector<Coverage> coverage;
  for (const View& view : views) {
    check_rank("visual_hull", "image", view.rgba.shape, 3, "[H, W, 4]");
    check_extent("visual_hull", "image", view.rgba.shape, 2, 4, "red, green, blue, alpha");
    coverage.emplace_back(view);
  }
  std::vector<std::uint8_t> hull(at(resolution * resolution * resolution), 0);
  const double cell = bounds.side / static_cast<double>(resolution);
  const Index blocks = resolution / 4;
  // Tests blocks of 4 x 4 x 4 cells first, which rules out most of the cube at a 64th of the cost.
  parallel_for(blocks, 1, [&](Index bz, Index) {
    for (Index by = 0; by < blocks; ++by)
      for (Index bx = 0; bx < blocks; ++bx) {
        if (!stays(coverage, bounds, cell, 4, 4 * bx, 4 * by, 4 * bz)) continue;
        for (Index i = 0; i < 64; ++i) {
          const Index x = 4 * bx + i % 4, y = 4 * by + i / 4 % 4, z = 4 * bz + i / 16;
          hull[at(x + resolution * (y + resolution * z))] = stays(coverage, bounds, cell, 1, x, y, z);
        }
      }
  });
  return hull;
}

Bounds tighten(const Bounds& bounds, std::span<const std::uint8_t> hull, Index resolution) {
  Index low[3] = {resolution, resolution, resolution}, high[3] = {0, 0, 0};
  for (Index c = 0; c < static_cast<Index>(hull.size()); ++c) {
    if (!hull[at(c)]) continue;
    const Index p[3] = {c % resolution, c / resolution % resolution, c / (resolution * resolution)};
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], p[a]);
      high[a] = std::max(high[a], p[a] + 1);
    }
  }
  if (low[0] >= high[0]) return bounds;
  const double cell = bounds.side / static_cast<double>(resolution);
  Index widest = 0;
  for (int a = 0; a < 3; ++a) widest = std::max(widest, high[a] - low[a] + 4);
  if (widest >= resolution) return bounds;
  Bounds tight;
  tight.side = static_cast<double>(widest) * cell;
  for (std::size_t a = 0; a < 3; ++a)
    tight.corner[a] = bounds.corner[a] + 0.5 * (static_cast<double>(low[a] + high[a]) * cell - tight.side);
  return tight;
}

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

std::vector<std::uint32_t> training_pixels(std::span<const View> views, std::optional<Index> margin) {
  if (margin && *margin < 0)
    throw ValueError("[training_pixels] margin must not be negative, got " + std::to_string(*margin));
  const Index count = static_cast<Index>(views.size());
  const Index size = count > 0 ? views[0].camera.height * views[0].camera.width : 0;
  if (count * size > Index{std::numeric_limits<std::uint32_t>::max()})
    throw ValueError("[training_pixels] views must have at most 2^32 - 1 pixels together, got " +
                     std::to_string(count * size));
  std::vector<std::vector<std::uint32_t>> of_view(at(count));
  parallel_for(count, 1, [&](Index v, Index) {
    const View& view = views[at(v)];
    const auto mask = margin ? near_alpha(view, *margin) : std::vector<std::uint8_t>(at(size), 1);
    for (Index p = 0; p < size; ++p)
      if (mask[at(p)] && is_valid(view, p))
        of_view[at(v)].push_back(static_cast<std::uint32_t>(v * size + p));
  });
  std::vector<std::uint32_t> all;
  for (const auto& pixels : of_view) all.insert(all.end(), pixels.begin(), pixels.end());
  return all;
}

}  // namespace fieldmark::nerf
