#include "solids.h"

#include <cmath>
#include <vector>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
double inner(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Returns a signed value, negative inside the solid, from its definition and independently of the
// intersections.
double outside(const Solid& s, const Vec3& p) {
  const double x = p[0], y = p[1], z = p[2], rho = std::hypot(x, y);
  switch (s.kind) {
    case SolidKind::sphere:
      return std::sqrt(inner(p, p)) - s.size[0];
    case SolidKind::box:
      return std::max({std::abs(x) - s.size[0], std::abs(y) - s.size[1], std::abs(z) - s.size[2]});
    case SolidKind::cylinder:
      return std::max(rho - s.size[0], std::abs(z) - s.size[1]);
    case SolidKind::cone:
      return std::max(rho - s.size[0] * (s.size[1] - z) / (2 * s.size[1]), std::abs(z) - s.size[1]);
    case SolidKind::torus:
      return std::hypot(rho - s.size[0], z) - s.size[1];
  }
  return 0;
}

std::array<double, 2> turned(double angle) { return {std::cos(angle), std::sin(angle)}; }

const std::vector<Solid> kSolids{
    {.kind = SolidKind::sphere, .centre = {0.1, 0.2, -0.3}, .size = {0.7, 0, 0}},
    {.kind = SolidKind::box, .centre = {0.1, -0.2, 0.3}, .turn = turned(0.6), .size = {0.3, 0.5, 0.7}},
    {.kind = SolidKind::cylinder, .centre = {0, 0.2, 0}, .turn = turned(-2), .size = {0.4, 0.6, 0}},
    {.kind = SolidKind::cone, .centre = {-0.1, 0, 0.1}, .turn = turned(1), .size = {0.5, 0.6, 0}},
    {.kind = SolidKind::torus, .centre = {0.1, 0, 0}, .size = {0.6, 0.25, 0}}};

Vec3 to_local(const Solid& s, const Vec3& p) {
  const double c = s.turn[0], n = s.turn[1], x = p[0] - s.centre[0], y = p[1] - s.centre[1];
  return {c * x + n * y, c * y - n * x, p[2] - s.centre[2]};
}

Ray random_ray(unsigned seed) {
  const auto r = uniform({6}, -1, 1, seed);
  Vec3 o{3 * r[0], 3 * r[1], 3 * r[2] + 4}, d{0.8 * r[3] - o[0], 0.8 * r[4] - o[1], 0.8 * r[5] - o[2]};
  const double n = std::sqrt(inner(d, d));
  return {o, {d[0] / n, d[1] / n, d[2] / n}};
}
Vec3 along(const Ray& r, double t) {
  return {r.origin[0] + t * r.direction[0], r.origin[1] + t * r.direction[1],
          r.origin[2] + t * r.direction[2]};
}
}  // namespace

TEST_CASE("solids: hits are on the surface, nothing is hit before, and misses pass outside") {
  for (const Solid& s : kSolids) {
    INFO("kind " << static_cast<int>(s.kind));
    int hits = 0;
    for (unsigned seed = 1; seed <= 300; ++seed) {
      const Ray ray = random_ray(seed);
      const auto hit = intersect(s, ray);
      hits += hit.has_value();
      if (hit) {
        CHECK(std::abs(outside(s, to_local(s, along(ray, hit->t)))) < 2e-7);
        for (std::size_t k = 0; k < 3; ++k)
          CHECK(std::abs(hit->local[k] - to_local(s, along(ray, hit->t))[k]) < 1e-12);
      }
      const double end = hit ? hit->t - 1e-4 : 8;
      for (int step = 0; step < 400; ++step)
        CHECK(outside(s, to_local(s, along(ray, end * step / 400))) > -1e-6);
    }
    CHECK(hits > 60);
    CHECK(hits < 290);
  }
}

TEST_CASE("solids: normals are unit, face the ray and are the gradient of the distance") {
  for (const Solid& s : kSolids)
    for (unsigned seed = 1; seed <= 100; ++seed) {
      const Ray ray = random_ray(seed);
      const auto hit = intersect(s, ray);
      if (!hit) continue;
      INFO("kind " << static_cast<int>(s.kind) << " seed " << seed);
      CHECK(std::abs(inner(hit->normal, hit->normal) - 1) < 1e-12);
      CHECK(inner(hit->normal, ray.direction) < 1e-3);
      const Vec3 p = along(ray, hit->t), out = along({p, hit->normal}, 1e-4),
                 in = along({p, hit->normal}, -1e-4);
      CHECK(outside(s, to_local(s, out)) > 5e-5);
      CHECK(outside(s, to_local(s, in)) < 0);
    }
}

TEST_CASE("solids: known distances, from outside, inside, along faces and past") {
  const Ray down{{0, 0, 5}, {0, 0, -1}}, side{{0, 0, 0}, {1, 0, 0}};
  const auto t = [](const Solid& s, const Ray& r) { return intersect(s, r).value_or(SolidHit{.t = -1}).t; };
  CHECK(t({.kind = SolidKind::sphere, .size = {2, 0, 0}}, down) == 3);
  CHECK(t({.kind = SolidKind::sphere, .size = {2, 0, 0}}, side) == 2);
  CHECK(t({.kind = SolidKind::box, .size = {1, 2, 3}}, down) == 2);
  CHECK(t({.kind = SolidKind::box, .size = {1, 2, 3}}, side) == 1);
  CHECK(t({.kind = SolidKind::cylinder, .size = {1.5, 1, 0}}, down) == 4);
  CHECK(t({.kind = SolidKind::cylinder, .size = {1.5, 1, 0}}, side) == 1.5);
  CHECK(std::abs(t({.kind = SolidKind::cone, .size = {1, 2, 0}}, side) - 0.5) < 1e-15);
  CHECK(t({.kind = SolidKind::torus, .size = {1, 0.25, 0}}, down) == -1);
  CHECK(std::abs(t({.kind = SolidKind::torus, .size = {1, 0.25, 0}}, side) - 0.75) < 2e-7);
  CHECK(t({.kind = SolidKind::sphere, .centre = {0, 0, 9}, .size = {2, 0, 0}}, down) == -1);  // behind
  CHECK(t({.kind = SolidKind::box, .centre = {0, 1.5, 0}, .size = {1, 1, 1}}, {{-5, 0, 0}, {1, 0, 0}}) == -1);
}

TEST_CASE("solids: the bounding sphere holds every hit") {
  for (const Solid& s : kSolids)
    for (unsigned seed = 1; seed <= 100; ++seed)
      if (const auto hit = intersect(s, random_ray(seed)))
        CHECK(std::sqrt(inner(hit->local, hit->local)) <= bounding_radius(s) + 1e-7);
}
