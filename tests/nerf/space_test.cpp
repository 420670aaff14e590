#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/nerf/space.h>
#include "marching.h"

#include <algorithm>
#include <cmath>

#include "support/catch.h"
#include "support/random.h"
#include "support/worst.h"
#include "vec3.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
const Space kCube{.bounds = {.corner = {-1, 0, 2}, .side = 4}};
const Space kNdc{.kind = SpaceKind::ndc, .near = 1.25, .slope_x = 0.4, .slope_y = 0.7};
const Space kContracted{
    .kind = SpaceKind::contracted, .bounds = {.corner = {1, 2, 3}, .side = 2}, .near = 0.5};

double distance(const Vec3& a, const Vec3& b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

Camera camera_at(const Vec3& eye, const Vec3& target, double angle = 0.9) {
  return make_camera(look_at(eye, target, {0, 1, 0}), angle, 9, 7);
}

// Returns the rays of some pixels in a space, and the same rays in the world.
CubeRays rays_of(const Space& space, const Camera& camera) {
  CubeRays rays;
  rays.resize(4);
  const float pixels[] = {0, 0, 8, 6, 4, 3, 1.25f, 5.5f};
  rays.set(space, 0, camera, pixels);
  return rays;
}
}  // namespace

TEST_CASE("space: rays of cameras far from the origin are those of cameras near it") {
  for (const Space& space : {kCube, kContracted})
    for (const double shift : {5e5, 1e7}) {
      const Vec3 eye{3, 4, 5}, target{1, 2, 3}, moved{shift, -shift, 0.5 * shift};
      Space there = space;
      for (std::size_t a = 0; a < 3; ++a) there.bounds.corner[a] += moved[a];
      const CubeRays near = rays_of(space, camera_at(eye, target)),
                     far = rays_of(there, camera_at(eye + moved, target + moved));
      for (std::size_t i = 0; i < near.origins.size(); ++i) {
        CHECK(std::abs(far.origins[i] - near.origins[i]) < 1e-6f);
        CHECK(std::abs(far.directions[i] - near.directions[i]) < 1e-6f);
      }
    }
}

TEST_CASE("space: points by hand") {
  CHECK(kCube.to_cube({1, 1, 1}) == Vec3{0.5, 0.25, -0.25});
  CHECK(kNdc.to_cube({0, 0, -1.25}) == Vec3{0.5, 0.5, 0});                // the plane
  CHECK(distance(kNdc.to_cube({5, -5, -5}), {0.9, -0.2, 0.75}) < 1e-15);  // -0.2: outside
  CHECK(distance(kNdc.to_cube({0, 0, -1e12}), {0.5, 0.5, 1}) < 1e-11);
  CHECK(kContracted.to_cube({2, 3, 4}) == Vec3{0.5, 0.5, 0.5});
  CHECK(kContracted.to_cube({3, 2.5, 4}) == Vec3{0.75, 0.375, 0.5});  // on a face of the inner cube: linear
  CHECK(kContracted.to_cube({4, 3, 4}) == Vec3{0.875, 0.5, 0.5});     // s = 2
  CHECK(distance(kContracted.to_cube({2, 3 - 1e12, 4}), {0.5, 0, 0.5}) < 1e-11);
}

TEST_CASE("space: to_world undoes to_cube") {
  const auto u = uniform({200, 3}, 0.001, 0.999, 4);
  for (const Space& space : {kCube, kNdc, kContracted})
    for (Index i = 0; i < 200; ++i) {
      const Vec3 x{u[3 * i], u[3 * i + 1], u[3 * i + 2]};
      CHECK(distance(space.to_cube(space.to_world(x)), x) < 1e-12);
    }
}

TEST_CASE("space: rays in a cube move and scale") {
  const Camera camera = camera_at({6, 3, 9}, {1, 1, 3});
  const CubeRays rays = rays_of(kCube, camera);
  CHECK(rays.directions == rays.seen_from);
  CHECK(rays.origins[0] == 1.75f);
  CHECK(rays.origins[10] == 0.75f);
  CHECK_FALSE(rays.batch(kCube).contracted);
}

TEST_CASE("space: rays in device coordinates pass through the images of the world's points, within 1e-5") {
  // In front of the plane, behind it, and looking along it.
  for (const auto& [eye, target] : {std::pair{Vec3{0.3, -0.2, 0.1}, Vec3{0.1, 0, -4}},
                                    {Vec3{-0.5, 0.2, -2}, Vec3{0, 0, -6}},
                                    {Vec3{-9, 0, -6}, Vec3{0, 0, -6}}}) {
    const CubeRays rays = rays_of(kNdc, camera_at(eye, target));
    for (std::size_t i = 0; i < 12; i += 3) {
      const Vec3 o{rays.origins[i], rays.origins[i + 1], rays.origins[i + 2]};
      const Vec3 d{rays.directions[i], rays.directions[i + 1], rays.directions[i + 2]};
      CHECK(std::abs(norm(d) - 1) < 1e-6);
      double last = -1;
      for (const double t : {3., 4., 7., 30.}) {
        Vec3 p;
        for (std::size_t a = 0; a < 3; ++a) p[a] = eye[a] + t * static_cast<double>(rays.seen_from[i + a]);
        if (p[2] > -kNdc.near) continue;
        const Vec3 away = kNdc.to_cube(p) - o;
        const double along = dot(away, d);
        CHECK(along > last);
        CHECK(distance(away, along * d) < 1e-5);
        last = along;
      }
    }
  }
}

TEST_CASE("space: rays that never come behind the plane miss the cube") {
  const CubeRays rays = rays_of(kNdc, camera_at({0, 0, 0}, {0, 0, 3}));
  for (std::size_t i = 0; i < 12; i += 3) {
    const CubeSpan span = intersect_unit_cube(&rays.origins[i], &rays.directions[i]);
    CHECK_FALSE(span.near < span.far);
  }
}

TEST_CASE(
    "space: contracted rays are linear, and contract() brings them to the images of the world's points") {
  const Vec3 eye{6, 3, 9};
  const CubeRays rays = rays_of(kContracted, camera_at(eye, {1, 1, 3}));
  CHECK(rays.directions == rays.seen_from);
  CHECK(rays.batch(kContracted).contracted);
  CHECK(rays.batch(kContracted).near == 0.125f);  // for a world of side 4
  for (const double t : {0., 2., 6., 100.})
    for (std::size_t i = 0; i < 12; i += 3) {
      float x[3];
      Vec3 p;
      for (std::size_t a = 0; a < 3; ++a) {
        x[a] = rays.origins[i + a] + static_cast<float>(t / 4) * rays.directions[i + a];
        p[a] = eye[a] + t * static_cast<double>(rays.seen_from[i + a]);
      }
      contract(x, x);
      CHECK(distance(kContracted.to_cube(p), {x[0], x[1], x[2]}) < 1e-6);
    }
}

TEST_CASE("space: seen cells are those of an image's cone, the same for every thread count") {
  const Camera camera = camera_at({3, 2, 14}, {1, 2, 4}, 0.2);
  const Camera two[] = {camera, camera_at({9, 2, 4}, {1, 2, 4}, 0.2)};
  for (const Space& space : {kCube, kContracted}) {
    const ScopedThreads serial(1);
    const auto seen = seen_cells(two, space, 12);
    const ScopedThreads parallel(2);
    CHECK(seen == seen_cells(two, space, 12));
    const auto first = seen_cells(std::span(two, 1), space, 12);
    Index more = 0, hidden = 0, inside = 0, outside = 0;
    for (std::size_t c = 0; c < seen.size(); ++c) {
      REQUIRE(seen[c] >= first[c]);
      more += seen[c] > first[c];
      hidden += !seen[c];
      // A cell whose centre is in the image, according to the camera's own rays.
      const auto cell = static_cast<Index>(c);
      const auto middle = [](Index i) { return (static_cast<double>(i) + 0.5) / 12; };
      const Vec3 p = space.to_world({middle(cell % 12), middle(cell / 12 % 12), middle(cell / 144)});
      const Vec3 to = normalised(p - camera.position());
      double best = -1;
      for (double y = 0; y < 7; y += 0.25)
        for (double x = 0; x < 9; x += 0.25)
          raise_to(best, dot(pixel_ray(camera, x - 0.5, y - 0.5).direction, to));
      REQUIRE(!std::isnan(best));
      if (best > 0.99995) {
        ++inside;
        CHECK(first[c] == 1);
      }
      if (space.kind == SpaceKind::cube && best < 0.998) {  // outer cells extend to infinity
        ++outside;
        CHECK(first[c] == 0);
      }
    }
    CAPTURE(inside, outside);
    CHECK(inside > 150);
    CHECK((space.kind != SpaceKind::cube || outside > 600));
    CHECK(more > 0);
    CHECK(hidden > 0);
  }
}

TEST_CASE("space: gradients come back to the world as differences say") {
  for (const Space& space : {kCube, kNdc, kContracted}) {
    CAPTURE(name_of(space.kind));
    const auto inside = uniform({40, 3}, 0.05, 0.95, 5), g = uniform({40, 3}, -1, 1, 6);
    for (Index i = 0; i < 40; ++i) {
      const Vec3 p = space.to_world({inside[3 * i], inside[3 * i + 1], inside[3 * i + 2]});
      const Vec3 slope = space.gradient_in_world(p, {g[3 * i], g[3 * i + 1], g[3 * i + 2]});
      for (std::size_t a = 0; a < 3; ++a) {
        const double h = 1e-5 * std::max(1., norm(p));
        Vec3 up = p, down = p;
        up[a] += h, down[a] -= h;
        const Vec3 change = (1 / (2 * h)) * (space.to_cube(up) - space.to_cube(down));
        const double want = change[0] * g[3 * i] + change[1] * g[3 * i + 1] + change[2] * g[3 * i + 2];
        CHECK(std::abs(slope[a] - want) < 1e-6 * std::max(norm(slope), 1e-3));
      }
    }
  }
}

TEST_CASE("space: kinds have names") {
  for (const SpaceKind kind : {SpaceKind::cube, SpaceKind::ndc, SpaceKind::contracted})
    CHECK(parse_space_kind(name_of(kind)) == kind);
  CHECK_THROWS_WITH(parse_space_kind("sphere"), "[space] kind must be cube, ndc or contracted, got sphere");
}
