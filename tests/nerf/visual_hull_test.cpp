#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/nerf/visual_hull.h>

#include <algorithm>
#include <cmath>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
constexpr double kRadius = 0.6;
constexpr Vec3 kCentre{0.3, -0.2, 0.1};

// Opaque where the ray through the pixel meets the ball: what a photograph of it would show.
Tensor<float> photograph(const Camera& camera) {
  Tensor<float> image(Shape{camera.height, camera.width, 4});
  for (Index y = 0; y < camera.height; ++y)
    for (Index x = 0; x < camera.width; ++x) {
      const Ray ray = pixel_ray(camera, static_cast<double>(x), static_cast<double>(y));
      double along = 0, square = 0;
      for (std::size_t a = 0; a < 3; ++a) {
        const double to = kCentre[a] - ray.origin[a];
        along += to * ray.direction[a];
        square += to * to;
      }
      image[4 * (y * camera.width + x) + 3] = square - along * along < kRadius * kRadius ? 1.f : 0.f;
    }
  return image;
}

struct Scene {
  std::vector<Tensor<float>> images;
  std::vector<Silhouette> silhouettes;
  Scene(int views, double distance) {
    images.reserve(static_cast<std::size_t>(views));
    for (int v = 0; v < views; ++v) {
      const double angle = 2.4 * v, height = 1.8 * (v + 0.5) / views - 0.9,
                   flat = std::sqrt(1 - height * height);
      const Vec3 eye{distance * flat * std::cos(angle), distance * flat * std::sin(angle), distance * height};
      const Camera camera = make_camera(look_at(eye, {0, 0, 0}, {0, 0, 1}), 0.8, 80, 64);
      images.push_back(photograph(camera));
      silhouettes.push_back({camera, &images.back()});
    }
  }
};

double distance_of_cell(const Bounds& b, Index n, Index c) {
  const double cell = b.side / static_cast<double>(n);
  const Index p[3] = {c % n, c / n % n, c / (n * n)};
  double square = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const double d = b.corner[a] + (static_cast<double>(p[a]) + 0.5) * cell - kCentre[a];
    square += d * d;
  }
  return std::sqrt(square);
}
}  // namespace

TEST_CASE("visual_hull: never cuts the ball, and cuts all but a rim outside of it") {
  const Scene scene(40, 4);
  const Bounds bounds;
  const Index n = 32;
  const auto hull = visual_hull(scene.silhouettes, bounds, n);
  Index kept_outside = 0, outside = 0;
  for (Index c = 0; c < n * n * n; ++c) {
    const double distance = distance_of_cell(bounds, n, c);
    const bool kept = hull[static_cast<std::size_t>(c)] != 0;
    if (distance < kRadius) REQUIRE(kept);
    if (distance > kRadius + 0.35) {
      ++outside;
      kept_outside += kept;
    }
  }
  CAPTURE(outside, kept_outside);
  CHECK(outside > 20000);
  CHECK(kept_outside * 100 < outside);
}

TEST_CASE("visual_hull: cells out of the image or behind the camera are kept") {
  // One camera inside of the cube, looking along -x at nothing.
  Tensor<float> empty(Shape{32, 32, 4});
  const Camera camera = make_camera(look_at({0.5, 0, 0}, {-1, 0, 0}, {0, 0, 1}), 0.8, 32, 32);
  const Silhouette one[] = {{camera, &empty}};
  const Index n = 16;
  const auto hull = visual_hull(one, {}, n);
  const auto at = [&](Index x, Index y, Index z) {
    return hull[static_cast<std::size_t>(x + n * (y + n * z))];
  };
  CHECK(at(14, 8, 8) == 1);  // behind
  CHECK(at(2, 0, 8) == 1);   // in front, out of the image
  CHECK(at(1, 8, 8) == 0);   // seen to be empty
}

TEST_CASE("visual_hull: without views nothing is ruled out") {
  const auto hull = visual_hull({}, {}, 8);
  CHECK(std::count(hull.begin(), hull.end(), 1) == 512);
}

TEST_CASE("visual_hull: tighten gives the smallest cube with two cells around") {
  const Scene scene(40, 4);
  const Bounds bounds;
  const Index n = 64;
  const auto hull = visual_hull(scene.silhouettes, bounds, n);
  const Bounds tight = tighten(bounds, hull, n);
  CHECK(tight.side < bounds.side);
  CHECK(tight.side < 2 * kRadius + 0.6);
  for (std::size_t a = 0; a < 3; ++a) {
    CHECK(tight.corner[a] < kCentre[a] - kRadius);
    CHECK(tight.corner[a] + tight.side > kCentre[a] + kRadius);
  }
  std::vector<std::uint8_t> one(512, 0);
  one[3 + 8 * (4 + 8 * 5)] = 1;
  const Bounds cell = tighten({.corner = {0, 0, 0}, .side = 8}, one, 8);
  CHECK(cell.side == 5);
  CHECK(cell.corner == std::array<double, 3>{1, 2, 3});
}

TEST_CASE("visual_hull: tighten leaves the bounds where nothing or everything is ruled out") {
  for (const std::uint8_t fill : {std::uint8_t{0}, std::uint8_t{1}}) {
    const Bounds same = tighten({}, std::vector<std::uint8_t>(512, fill), 8);
    CHECK(same.side == 3);
    CHECK(same.corner == std::array<double, 3>{-1.5, -1.5, -1.5});
  }
}

TEST_CASE("visual_hull: errors name image and shape") {
  const Tensor<float> opaque(Shape{8, 8, 3});
  const Silhouette one[] = {{make_camera(look_at({4, 0, 0}, {0, 0, 0}, {0, 0, 1}), 0.8, 8, 8), &opaque}};
  CHECK_THROWS_WITH(visual_hull(one, {}, 8), Contains("[visual_hull] image: axis 2 must be 4"));
  CHECK_THROWS_WITH(visual_hull({}, {}, 6),
                    "[visual_hull] resolution must be a multiple of 4 from 4 to 512, got 6");
}

TEST_CASE("visual_hull: the same for one and two threads") {
  const Scene scene(5, 4);
  const int before = threads();
  set_threads(1);
  const auto one = visual_hull(scene.silhouettes, {}, 32);
  set_threads(2);
  const auto two = visual_hull(scene.silhouettes, {}, 32);
  set_threads(before);
  CHECK(one == two);
}
