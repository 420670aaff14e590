#include <fieldmark/engine/parallel.h>
#include <fieldmark/nerf/space.h>

#include <algorithm>
#include <cmath>

#include "checks.h"
#include "rotation.h"

namespace fieldmark::nerf {
namespace {

constexpr double kQuarter = 0.25;
constexpr double kFar = 64;  // cube sides from the origin within which a float is precise enough
constexpr std::array<const char*, 3> kNames{"cube", "ndc", "contracted"};

double largest(const Vec3& y) { return std::max({std::abs(y[0]), std::abs(y[1]), std::abs(y[2])}); }

// Writes a ray that misses the cube, for one that the space does not contain.
void miss(float* o, float* d) {
  for (int a = 0; a < 3; ++a) o[a] = 2, d[a] = a == 0;
}

// Maps a line under x -> (-a x / z, -b y / z, near / z): with q = o + t d,
//   image(q) - image(o) = t / (o_z q_z) (-a (d_x o_z - o_x d_z), -b (d_y o_z - o_y d_z), -near d_z),
// whose first factor is positive while both points are in front of the camera.
void to_ndc(const Space& s, const float* origin, const float* direction, float* o, float* d) {
  Vec3 p{origin[0], origin[1], origin[2]};
  const Vec3 w{direction[0], direction[1], direction[2]};
  if (p[2] > -s.near) {
    if (!(w[2] < 0)) return miss(o, d);
    p = p + ((-s.near - p[2]) / w[2]) * w;
    p[2] = -s.near;
  }
  const Vec3 along{-s.slope_x * (w[0] * p[2] - p[0] * w[2]), -s.slope_y * (w[1] * p[2] - p[1] * w[2]),
                   -s.near * w[2]};
  const Vec3 image = s.to_cube(p);
  const double length = std::hypot(along[0], along[1], along[2]);
  if (!(length > 0)) return miss(o, d);
  for (std::size_t a = 0; a < 3; ++a) {
    o[a] = static_cast<float>(image[a]);
    d[a] = static_cast<float>(along[a] / length);
  }
}

// Returns the world length of a cube side where the map is linear.
double unit(const Space& s) { return s.kind == SpaceKind::contracted ? 2 * s.bounds.side : s.bounds.side; }

bool sees(const Camera& c, const Vec3& p) {
  const Vec3 v = p - c.position();
  const double depth = -dot(pose_column(c.pose, 2), v);
  if (!(depth > 0)) return false;
  const double x = c.cx + c.fx * dot(pose_column(c.pose, 0), v) / depth,
               y = c.cy - c.fy * dot(pose_column(c.pose, 1), v) / depth;
  return x >= 0 && x < static_cast<double>(c.width) && y >= 0 && y < static_cast<double>(c.height);
}

}  // namespace

std::string name_of(SpaceKind kind) { return kNames[static_cast<std::size_t>(kind)]; }

SpaceKind parse_space_kind(std::string_view name) {
  for (std::size_t i = 0; i < kNames.size(); ++i)
    if (name == kNames[i]) return static_cast<SpaceKind>(i);
  throw ValueError("[space] kind must be cube, ndc or contracted, got " + std::string(name));
}

Vec3 Space::to_cube(const Vec3& p) const {
  if (kind == SpaceKind::ndc)
    return {0.5 - slope_x * p[0] / p[2], 0.5 - slope_y * p[1] / p[2], 1 + near / p[2]};
  Vec3 x;
  for (std::size_t a = 0; a < 3; ++a) x[a] = (p[a] - bounds.corner[a]) / bounds.side;
  if (kind == SpaceKind::cube) return x;
  for (double& v : x) v = 2 * v - 1;
  const double s = largest(x), scale = s <= 1 ? kQuarter : kQuarter * (2 - 1 / s) / s;
  for (double& v : x) v = 0.5 + scale * v;
  return x;
}

Vec3 Space::to_world(const Vec3& x) const {
  if (kind == SpaceKind::ndc) {
    const double z = near / (x[2] - 1);
    return {(0.5 - x[0]) * z / slope_x, (0.5 - x[1]) * z / slope_y, z};
  }
  Vec3 y = x;
  if (kind == SpaceKind::contracted) {
    for (double& v : y) v = (v - 0.5) / kQuarter;
    const double c = largest(y), scale = c <= 1 ? 1 : 1 / ((2 - c) * c);  // c = 2 - 1/s
    for (double& v : y) v = 0.5 * (1 + scale * v);
  }
  for (std::size_t a = 0; a < 3; ++a) y[a] = bounds.corner[a] + bounds.side * y[a];
  return y;
}

// Contracted, with k(s) = (2 - 1/s) / s:  dx_i/dy_j = k / 4 if i = j, and where s = |y_m| > 1, on top of it
// k'(s) / 4 y_i sign(y_m) if j = m, with k'(s) = 2 (1 - s) / s^3.
Vec3 Space::gradient_in_world(const Vec3& p, const Vec3& g) const {
  if (kind == SpaceKind::ndc)
    return {-slope_x / p[2] * g[0], -slope_y / p[2] * g[1],
            (slope_x * p[0] * g[0] + slope_y * p[1] * g[1] - near * g[2]) / (p[2] * p[2])};
  if (kind == SpaceKind::cube) return (1 / bounds.side) * g;
  Vec3 y;
  for (std::size_t a = 0; a < 3; ++a) y[a] = 2 * (p[a] - bounds.corner[a]) / bounds.side - 1;
  const double s = largest(y), k = s <= 1 ? 1 : (2 - 1 / s) / s;
  Vec3 out = k * g;
  if (s > 1) {
    const double along = 2 * (1 - s) / (s * s * s) * dot(y, g);
    for (std::size_t a = 0; a < 3; ++a)
      if (std::abs(y[a]) == s) {
        out[a] += y[a] > 0 ? along : -along;
        break;
      }
  }
  return (2 * kQuarter / bounds.side) * out;
}

RayBatch RayBatch::part(Index begin, Index n) const {
  const auto rows = [&](std::span<const float> all) { return all.subspan(at(3 * begin), at(3 * n)); };
  return {rows(origins), rows(directions), rows(seen_from), contracted, near};
}

void CubeRays::resize(Index n) {
  for (auto* buffer : {&origins, &directions, &seen_from}) buffer->resize(at(3 * n));
}

void CubeRays::set(const Space& space, Index first, const Camera& camera, std::span<const float> pixels) {
  const std::size_t row = at(3 * first), n = pixels.size() / 2 * 3;
  float *o = &origins[row], *d = &directions[row], *world = &seen_from[row];
  camera_rays(camera, pixels, o, world);
  if (space.kind == SpaceKind::ndc) {
    for (std::size_t i = 0; i < n; i += 3) to_ndc(space, o + i, world + i, o + i, d + i);
    return;
  }
  std::copy_n(world, n, d);
  const double side = unit(space), corner = space.kind == SpaceKind::contracted ? 0.25 : 0;
  // Subtracts the corner in double: georeferenced cameras are millions of sides from the origin, where a
  // float would round their positions.
  const Vec3 eye = camera.position();
  const bool far = largest(eye) > kFar * side;
  for (std::size_t i = 0; i < n; ++i)
    o[i] = static_cast<float>(
        corner + ((far ? eye[i % 3] : static_cast<double>(o[i])) - space.bounds.corner[i % 3]) / side);
}

RayBatch CubeRays::batch(const Space& space) const {
  const bool contracted = space.kind == SpaceKind::contracted;
  return {origins, directions, seen_from, contracted,
          contracted ? static_cast<float>(space.near / unit(space)) : 0.f};
}

void contract(const float* p, float* x) {
  float y[3], s = 0;
  for (int a = 0; a < 3; ++a) {
    y[a] = p[a] - 0.5f;
    s = std::max(s, 4 * std::abs(y[a]));
  }
  const float scale = s <= 1 ? 1.f : (2 - 1 / s) / s;
  for (int a = 0; a < 3; ++a) x[a] = 0.5f + scale * y[a];
}

std::vector<std::uint8_t> seen_cells(std::span<const Camera> cameras, const Space& space, Index resolution) {
  std::vector<std::uint8_t> seen(at(resolution * resolution * resolution));
  const double side = 1 / static_cast<double>(resolution);
  parallel_for(resolution, 1, [&](Index first, Index last) {
    std::size_t likely = 0;  // tried first: a camera that sees a cell sees its neighbours
    for (Index z = first; z < last; ++z)
      for (Index y = 0; y < resolution; ++y)
        for (Index x = 0; x < resolution; ++x) {
          std::uint8_t& cell = seen[at(x + resolution * (y + resolution * z))];
          for (int corner = 0; corner < 9 && !cell; ++corner) {
            // Slightly inside the cell, because the cube's faces may lie at infinity.
            const auto place = [&](Index i, int bit) {
              const double shift = corner == 8 ? 0.5 : (corner >> bit & 1) ? 0.999 : 0.001;
              return (static_cast<double>(i) + shift) * side;
            };
            const Vec3 p = space.to_world({place(x, 0), place(y, 1), place(z, 2)});
            for (std::size_t c = 0; c < cameras.size() && !cell; ++c) {
              const std::size_t camera = (likely + c) % cameras.size();
              if (sees(cameras[camera], p)) cell = 1, likely = camera;
            }
          }
        }
  });
  return seen;
}

}  // namespace fieldmark::nerf
