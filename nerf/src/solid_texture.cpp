#include "solid_texture.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "vec3.h"

namespace fieldmark::nerf {
namespace {
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
      // The offset keeps cell borders off the faces of solids, where rounding would decide.
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
