#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/nerf/visual_hull.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::nerf {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

// Counts of opaque pixels left of and above, so that any rectangle is asked with four look-ups.
struct Coverage {
  Camera camera;
  Index width, height;
  std::vector<std::int32_t> sum;  // [height + 1, width + 1]

  explicit Coverage(const Silhouette& s)
      : camera(s.camera), width(s.image->shape[1]), height(s.image->shape[0]) {
    sum.assign(at((width + 1) * (height + 1)), 0);
    for (Index y = 0; y < height; ++y)
      for (Index x = 0; x < width; ++x)
        sum[at((y + 1) * (width + 1) + x + 1)] =
            sum[at(y * (width + 1) + x + 1)] + sum[at((y + 1) * (width + 1) + x)] -
            sum[at(y * (width + 1) + x)] + ((*s.image)[4 * (y * width + x) + 3] > 0 ? 1 : 0);
  }

  bool may_contain(const double p[3], double radius) const {
    const Pose& m = camera.pose;
    const double d[3] = {p[0] - m[3], p[1] - m[7], p[2] - m[11]};
    const double x = m[0] * d[0] + m[4] * d[1] + m[8] * d[2], y = m[1] * d[0] + m[5] * d[1] + m[9] * d[2];
    const double depth = -(m[2] * d[0] + m[6] * d[1] + m[10] * d[2]);
    if (depth <= radius) return true;
    // The ball's nearest point bounds how large it can look; one more pixel for the image's own sampling.
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

// Whether no view rules out the cube of `cells` cells at integer position (x, y, z).
bool stays(const std::vector<Coverage>& views, const Bounds& b, double cell, Index cells, Index x, Index y,
           Index z) {
  const double half = 0.5 * static_cast<double>(cells);
  const double p[3] = {b.corner[0] + (static_cast<double>(x) + half) * cell,
                       b.corner[1] + (static_cast<double>(y) + half) * cell,
                       b.corner[2] + (static_cast<double>(z) + half) * cell};
  const double radius = half * cell * std::sqrt(3.0);
  return std::all_of(views.begin(), views.end(), [&](const Coverage& v) { return v.may_contain(p, radius); });
}

}  // namespace

std::vector<std::uint8_t> visual_hull(std::span<const Silhouette> silhouettes, const Bounds& bounds,
                                      Index resolution) {
  if (resolution < 4 || resolution > 512 || resolution % 4 != 0)
    throw ValueError("[visual_hull] resolution must be a multiple of 4 from 4 to 512, got " +
                     std::to_string(resolution));
  std::vector<Coverage> views;
  for (const Silhouette& s : silhouettes) {
    check_rank("visual_hull", "image", s.image->shape, 3, "[H, W, 4]");
    check_extent("visual_hull", "image", s.image->shape, 2, 4, "red, green, blue, alpha");
    views.emplace_back(s);
  }
  std::vector<std::uint8_t> hull(at(resolution * resolution * resolution), 0);
  const double cell = bounds.side / static_cast<double>(resolution);
  const Index blocks = resolution / 4;
  // Blocks of 4 x 4 x 4 first: most of the cube goes at a 64th of the price.
  parallel_for(blocks, 1, [&](Index bz, Index) {
    for (Index by = 0; by < blocks; ++by)
      for (Index bx = 0; bx < blocks; ++bx) {
        if (!stays(views, bounds, cell, 4, 4 * bx, 4 * by, 4 * bz)) continue;
        for (Index i = 0; i < 64; ++i) {
          const Index x = 4 * bx + i % 4, y = 4 * by + i / 4 % 4, z = 4 * bz + i / 16;
          hull[at(x + resolution * (y + resolution * z))] = stays(views, bounds, cell, 1, x, y, z);
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

}  // namespace fieldmark::nerf
