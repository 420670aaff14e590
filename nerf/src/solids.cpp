#include "solids.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "vec3.h"

namespace fieldmark::nerf {
namespace {
constexpr double kMiss = std::numeric_limits<double>::infinity();
constexpr double kNear = 1e-9;  // a ray that starts on a surface does not hit it again there

// std::hypot guards against overflow, which no scene needs, and is several times slower.
double length2(double x, double y) { return std::sqrt(x * x + y * y); }

struct Local {
  double t = kMiss;
  Vec3 normal{};
};

// Keeps the nearer of two surfaces in front of the ray.
void consider(Local& best, double t, const Vec3& normal) {
  if (t > kNear && t < best.t) best = {t, normal};
}

Local hit_sphere(const Vec3& o, const Vec3& d, double radius) {
  Local best;
  const double b = dot(o, d), disc = b * b - dot(o, o) + radius * radius;
  if (disc < 0) return best;
  for (const double t : {-b - std::sqrt(disc), -b + std::sqrt(disc)})
    consider(best, t, (1 / radius) * (o + t * d));
  return best;
}

Local hit_box(const Vec3& o, const Vec3& d, const Vec3& half) {
  double enter = -kMiss, leave = kMiss;
  std::size_t enter_axis = 0, leave_axis = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    if (d[k] == 0) {
      if (std::abs(o[k]) > half[k]) return {};
      continue;
    }
    const double a = (-half[k] - o[k]) / d[k], b = (half[k] - o[k]) / d[k];
    if (std::min(a, b) > enter) enter = std::min(a, b), enter_axis = k;
    if (std::max(a, b) < leave) leave = std::max(a, b), leave_axis = k;
  }
  Local best;
  if (enter > leave) return best;
  Vec3 n{};
  n[enter_axis] = d[enter_axis] > 0 ? -1 : 1;
  consider(best, enter, n);
  n = {};
  n[leave_axis] = d[leave_axis] > 0 ? 1 : -1;
  consider(best, leave, n);
  return best;
}

void consider_disc(Local& best, const Vec3& o, const Vec3& d, double z, double radius) {
  if (d[2] == 0) return;
  const double t = (z - o[2]) / d[2], x = o[0] + t * d[0], y = o[1] + t * d[1];
  if (x * x + y * y <= radius * radius) consider(best, t, {0, 0, z < 0 ? -1.0 : 1.0});
}

// Cylinder and cone are one surface: radius(z) = r0 - slope (z + h) for |z| <= h, closed by discs.
Local hit_round(const Vec3& o, const Vec3& d, double r0, double half_height, double slope) {
  Local best;
  const double rim = r0 - slope * (o[2] + half_height), grow = -slope * d[2];
  const double a = d[0] * d[0] + d[1] * d[1] - grow * grow;
  const double b = o[0] * d[0] + o[1] * d[1] - rim * grow;
  const double c = o[0] * o[0] + o[1] * o[1] - rim * rim;
  const double disc = b * b - a * c;
  if (disc >= 0 && a != 0) {
    for (const double t : {(-b - std::sqrt(disc)) / a, (-b + std::sqrt(disc)) / a}) {
      const Vec3 p = o + t * d;
      if (std::abs(p[2]) > half_height || rim + t * grow < 0) continue;
      const double radius = length2(p[0], p[1]);
      if (radius > 0) consider(best, t, normalised({p[0] / radius, p[1] / radius, slope}));
    }
  }
  consider_disc(best, o, d, -half_height, r0);
  if (slope == 0) consider_disc(best, o, d, half_height, r0);
  return best;
}

Local hit_torus(const Vec3& o, const Vec3& d, double ring, double tube) {
  const auto distance = [&](const Vec3& p) {
    return std::abs(length2(length2(p[0], p[1]) - ring, p[2]) - tube);
  };
  const double b = dot(o, d), far = ring + tube, disc = b * b - dot(o, o) + far * far;
  if (disc < 0) return {};
  const double end = -b + std::sqrt(disc);
  double t = std::max(0.0, -b - std::sqrt(disc));
  if (t == 0 && distance(o) < 1e-6) t = 1e-5;  // starts on the surface: step off it
  for (int step = 0; step < 256 && t <= end; ++step) {
    const Vec3 p = o + t * d;
    const double gap = distance(p);
    if (gap < 1e-7) {
      const double radius = length2(p[0], p[1]), inward = 1 - ring / radius;
      return {t, normalised({p[0] * inward, p[1] * inward, p[2]})};
    }
    t += gap;
  }
  return {};
}

Local hit_local(const Solid& s, const Vec3& o, const Vec3& d) {
  switch (s.kind) {
    case SolidKind::sphere:
      return hit_sphere(o, d, s.size[0]);
    case SolidKind::box:
      return hit_box(o, d, s.size);
    case SolidKind::cylinder:
      return hit_round(o, d, s.size[0], s.size[1], 0);
    case SolidKind::cone:
      return hit_round(o, d, s.size[0], s.size[1], s.size[0] / (2 * s.size[1]));
    case SolidKind::torus:
      return hit_torus(o, d, s.size[0], s.size[1]);
  }
  return {};
}

constexpr double kTurn = 2 * std::numbers::pi;

// Bit mixing of the lattice point (the finaliser of MurmurHash3), to [0, 1).
double lattice(std::int64_t x, std::int64_t y, std::int64_t z, std::uint32_t seed) {
  std::uint32_t h = seed + static_cast<std::uint32_t>(x) * 0x9E3779B1u +
                    static_cast<std::uint32_t>(y) * 0x85EBCA77u + static_cast<std::uint32_t>(z) * 0xC2B2AE3Du;
  h = (h ^ (h >> 16)) * 0x85EBCA6Bu;
  h = (h ^ (h >> 13)) * 0xC2B2AE35u;
  return static_cast<double>(h ^ (h >> 16)) * 0x1.0p-32;
}

double octaves(const Vec3& p, std::uint32_t seed, int count) {
  double sum = 0, weight = 1, total = 0, frequency = 1;
  for (int k = 0; k < count; ++k) {
    sum += weight * value_noise(frequency * p, seed + static_cast<std::uint32_t>(k));
    total += weight;
    weight *= 0.6;
    frequency *= 2.03;  // not 2: lattice points of the octaves must not coincide
  }
  return sum / total;
}

double share_of_b(const SolidTexture& t, const Vec3& p) {
  const Vec3 q = (1 / t.scale) * p;
  switch (t.kind) {
    case TextureKind::flat:
      return 0;
    case TextureKind::checker: {
      // The offset keeps cell borders away from the faces of solids, where rounding would decide.
      const double cells =
          std::floor(2 * q[0] + 0.017) + std::floor(2 * q[1] + 0.017) + std::floor(2 * q[2] + 0.017);
      return std::fmod(std::abs(cells), 2);
    }
    case TextureKind::stripes:
      return std::sin(6 * std::atan2(p[1], p[0]) + kTurn * q[2] / 8) > 0 ? 1 : 0;
    case TextureKind::rings:
      return 0.5 + 0.5 * std::sin(kTurn * (q[2] + 0.3 * std::hypot(q[0], q[1])));
    case TextureKind::noise:
      return std::clamp(2.2 * octaves(q, t.seed, 4) - 0.6, 0.0, 1.0);
    case TextureKind::marble:
      return 0.5 + 0.5 * std::sin(kTurn * (q[0] + q[2] + 1.5 * octaves(q, t.seed, 3)));
  }
  return 0;
}
}  // namespace

double bounding_radius(const Solid& s) {
  switch (s.kind) {
    case SolidKind::sphere:
      return s.size[0];
    case SolidKind::box:
      return norm(s.size);
    case SolidKind::cylinder:
    case SolidKind::cone:
      return length2(s.size[0], s.size[1]);
    case SolidKind::torus:
      return s.size[0] + s.size[1];
  }
  return 0;
}

std::optional<SolidHit> intersect(const Solid& solid, const Ray& ray) {
  const Vec3 o = ray.origin - solid.centre;
  const double radius = bounding_radius(solid), b = dot(o, ray.direction);
  if (b * b - dot(o, o) + radius * radius < -1e-12) return std::nullopt;
  const auto [c, s] = solid.turn;
  const auto to_local = [c = c, s = s](const Vec3& v) {
    return Vec3{c * v[0] + s * v[1], c * v[1] - s * v[0], v[2]};
  };
  const Vec3 lo = to_local(o), ld = to_local(ray.direction);
  const Local hit = hit_local(solid, lo, ld);
  if (hit.t == kMiss) return std::nullopt;
  const Vec3& n = hit.normal;
  return SolidHit{hit.t, {c * n[0] - s * n[1], s * n[0] + c * n[1], n[2]}, lo + hit.t * ld};
}

double value_noise(const Vec3& point, std::uint32_t seed) {
  std::int64_t i[3];
  double f[3];
  for (std::size_t k = 0; k < 3; ++k) {
    const double floor = std::floor(point[k]), u = point[k] - floor;
    i[k] = static_cast<std::int64_t>(std::fmod(floor, 0x1.0p31));
    f[k] = u * u * (3 - 2 * u);
  }
  double value = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int dx = corner & 1, dy = corner >> 1 & 1, dz = corner >> 2;
    const double w = (dx ? f[0] : 1 - f[0]) * (dy ? f[1] : 1 - f[1]) * (dz ? f[2] : 1 - f[2]);
    value += w * lattice(i[0] + dx, i[1] + dy, i[2] + dz, seed);
  }
  return value;
}

Vec3 texture_colour(const SolidTexture& texture, const Vec3& point) {
  const double s = share_of_b(texture, point);
  return (1 - s) * texture.a + s * texture.b;
}

}  // namespace fieldmark::nerf
