#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "silhouettes.h"
#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
constexpr double kRadius = 0.6;
constexpr Vec3 kSphereCentre{0.3, -0.2, 0.1};

// Returns an image that is opaque where the ray through the pixel meets the ball.
Tensor<float> image_of_ball(const Camera& camera) {
  Tensor<float> image(Shape{camera.height, camera.width, 4});
  for (Index y = 0; y < camera.height; ++y)
    for (Index x = 0; x < camera.width; ++x) {
      const Ray ray = pixel_ray(camera, static_cast<double>(x), static_cast<double>(y));
      double along = 0, square = 0;
      for (std::size_t a = 0; a < 3; ++a) {
        const double to = kSphereCentre[a] - ray.origin[a];
        along += to * ray.direction[a];
        square += to * to;
      }
      image[4 * (y * camera.width + x) + 3] = square - along * along < kRadius * kRadius ? 1.f : 0.f;
    }
  return image;
}

struct Scene {
  std::vector<View> views;
  Scene(int count, double distance) {
    for (int v = 0; v < count; ++v) {
      const double angle = 2.4 * v, height = 1.8 * (v + 0.5) / count - 0.9,
                   flat = std::sqrt(1 - height * height);
      const Vec3 eye{distance * flat * std::cos(angle), distance * flat * std::sin(angle), distance * height};
      const Camera camera = make_camera(look_at(eye, {0, 0, 0}, {0, 0, 1}), 0.8, 80, 64);
      views.push_back({.camera = camera, .rgba = image_of_ball(camera), .name = {}});
    }
  }
};

double distance_of_cell(const Bounds& b, Index n, Index c) {
  const double cell = b.side / static_cast<double>(n);
  const Index p[3] = {c % n, c / n % n, c / (n * n)};
  double square = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const double d = b.corner[a] + (static_cast<double>(p[a]) + 0.5) * cell - kSphereCentre[a];
    square += d * d;
  }
  return std::sqrt(square);
}
View sparse_view(Index width, Index height, unsigned seed) {
  View view;
  view.camera = make_camera(look_at({0, -3, 1}, {0, 0, 0}, {0, 0, 1}), 0.7, width, height);
  view.rgba = Tensor<float>({height, width, 4});
  const auto u = uniform({height * width}, 0, 1, seed);
  for (Index p = 0; p < height * width; ++p) view.rgba[4 * p + 3] = u[p] < 0.01 ? 0.5f : 0.f;
  return view;
}
}  // namespace

TEST_CASE("silhouettes: never cuts the ball, and cuts all but a rim outside of it") {
  const Scene scene(40, 4);
  const Bounds bounds;
  const Index n = 32;
  const auto hull = visual_hull(scene.views, bounds, n);
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

TEST_CASE("silhouettes: cells out of the image or behind the camera are kept") {
  // One camera inside the cube, looking along -x at nothing.
  const Camera camera = make_camera(look_at({0.5, 0, 0}, {-1, 0, 0}, {0, 0, 1}), 0.8, 32, 32);
  const View one[] = {{.camera = camera, .rgba = Tensor<float>({32, 32, 4}), .name = {}}};
  const Index n = 16;
  const auto hull = visual_hull(one, {}, n);
  const auto at = [&](Index x, Index y, Index z) {
    return hull[static_cast<std::size_t>(x + n * (y + n * z))];
  };
  CHECK(at(14, 8, 8) == 1);  // behind the camera
  CHECK(at(2, 0, 8) == 1);   // in front of it, outside the image
  CHECK(at(1, 8, 8) == 0);   // seen to be empty
}

TEST_CASE("silhouettes: where a mask hides the object nothing is ruled out, and no ray is worth it") {
  Scene scene(40, 4);
  const Index n = 32;
  const auto before = visual_hull(scene.views, {}, n);
  // A mask over the left half of the ball, where the masked object has cut alpha to 0.
  for (View& v : scene.views) {
    v.valid.assign(80 * 64, 1);
    for (Index p = 0; p < 80 * 64; ++p)
      if (p % 80 < 40) v.valid[static_cast<std::size_t>(p)] = 0, v.rgba[4 * p + 3] = 0;
  }
  const auto hull = visual_hull(scene.views, {}, n);
  for (std::size_t c = 0; c < hull.size(); ++c)
    if (before[c]) REQUIRE(hull[c] == 1);
  CHECK(std::count(hull.begin(), hull.end(), 0) > 30000);  // of 32768: the other half still cuts
  for (const auto margin : {std::optional<Index>(3), std::optional<Index>()}) {
    const auto pixels = training_pixels(scene.views, margin);
    CHECK(!pixels.empty());
    for (const auto p : pixels) REQUIRE(p % 80 >= 40);
    if (!margin) CHECK(pixels.size() == 40 * 40 * 64);
  }
}

TEST_CASE("silhouettes: without views nothing is ruled out") {
  const auto hull = visual_hull({}, {}, 8);
  CHECK(std::count(hull.begin(), hull.end(), 1) == 512);
}

TEST_CASE("silhouettes: tighten gives the smallest cube with two cells around") {
  const Scene scene(40, 4);
  const Bounds bounds;
  const Index n = 64;
  const auto hull = visual_hull(scene.views, bounds, n);
  const Bounds tight = tighten(bounds, hull, n);
  CHECK(tight.side < bounds.side);
  CHECK(tight.side < 2 * kRadius + 0.6);
  for (std::size_t a = 0; a < 3; ++a) {
    CHECK(tight.corner[a] < kSphereCentre[a] - kRadius);
    CHECK(tight.corner[a] + tight.side > kSphereCentre[a] + kRadius);
  }
  std::vector<std::uint8_t> one(512, 0);
  one[3 + 8 * (4 + 8 * 5)] = 1;
  const Bounds cell = tighten({.corner = {0, 0, 0}, .side = 8}, one, 8);
  CHECK(cell.side == 5);
  CHECK(cell.corner == std::array<double, 3>{1, 2, 3});
}

TEST_CASE("silhouettes: tighten leaves the bounds where nothing or everything is ruled out") {
  for (const std::uint8_t fill : {std::uint8_t{0}, std::uint8_t{1}}) {
    const Bounds same = tighten({}, std::vector<std::uint8_t>(512, fill), 8);
    CHECK(same.side == 3);
    CHECK(same.corner == std::array<double, 3>{-1.5, -1.5, -1.5});
  }
}

TEST_CASE("silhouettes: errors name image and shape") {
  const View one[] = {{.camera = make_camera(look_at({4, 0, 0}, {0, 0, 0}, {0, 0, 1}), 0.8, 8, 8),
                       .rgba = Tensor<float>({8, 8, 3}),
                       .name = {}}};
  CHECK_THROWS_WITH(visual_hull(one, {}, 8), Contains("[visual_hull] image: axis 2 must be 4"));
  CHECK_THROWS_WITH(visual_hull({}, {}, 6),
                    "[visual_hull] resolution must be a multiple of 4 from 4 to 512, got 6");
}

TEST_CASE("silhouettes: the same for one and two threads") {
  const Scene scene(5, 4);
  const ScopedThreads serial(1);
  const auto one = visual_hull(scene.views, {}, 32);
  const ScopedThreads parallel(2);
  const auto two = visual_hull(scene.views, {}, 32);
  CHECK(one == two);
}

TEST_CASE("silhouettes: exactly those with alpha within the margin") {
  const std::vector<View> views{sparse_view(37, 23, 1), sparse_view(37, 23, 2)};
  for (Index margin : {0, 1, 4, 50}) {
    std::vector<std::uint32_t> want;
    for (Index v = 0; v < 2; ++v)
      for (Index p = 0; p < 37 * 23; ++p) {
        bool close = false;
        for (Index q = 0; q < 37 * 23; ++q)
          close = close || (views[static_cast<std::size_t>(v)].rgba[4 * q + 3] > 0 &&
                            std::abs(p % 37 - q % 37) <= margin && std::abs(p / 37 - q / 37) <= margin);
        if (close) want.push_back(static_cast<std::uint32_t>(v * 37 * 23 + p));
      }
    CHECK(training_pixels(views, margin) == want);
  }
}

TEST_CASE("silhouettes: no ray outside the margin meets a cell of the hull") {
  std::vector<View> views;
  for (int k = 0; k < 5; ++k) {
    View view;
    const double angle = 1.3 * k;
    view.camera = make_camera(look_at({3 * std::cos(angle), 3 * std::sin(angle), 1.0}, {0, 0, 0}, {0, 0, 1}),
                              1.5, 64, 64);  // sees the whole cube
    view.rgba = Tensor<float>({64, 64, 4});
    for (Index y = 28; y < 36; ++y)
      for (Index x = 27; x < 38; ++x) view.rgba[4 * (64 * y + x) + 3] = 1;
    views.push_back(view);
  }
  const Bounds bounds{{-1, -1, -1}, 2};
  const Index n = 32;
  const auto hull = visual_hull(views, bounds, n);
  const auto pixels = training_pixels(views, hull_margin(views, bounds, n));
  REQUIRE(!pixels.empty());
  REQUIRE(pixels.size() < 5 * 64 * 64);
  std::size_t next = 0;
  Index met = 0;
  for (Index v = 0; v < 5; ++v)
    for (Index p = 0; p < 64 * 64; ++p) {
      if (next < pixels.size() && pixels[next] == static_cast<std::uint32_t>(v * 64 * 64 + p)) {
        ++next;
        continue;
      }
      const Ray ray = pixel_ray(views[static_cast<std::size_t>(v)].camera, static_cast<double>(p % 64),
                                static_cast<double>(p / 64));
      for (double t = 0; t < 6; t += 0.01) {
        Index cell[3];
        bool inside = true;
        for (std::size_t a = 0; a < 3; ++a) {
          const double x = (ray.origin[a] + t * ray.direction[a] + 1) / 2 * static_cast<double>(n);
          cell[a] = static_cast<Index>(std::floor(x));
          inside = inside && cell[a] >= 0 && cell[a] < n;
        }
        met += inside && hull[static_cast<std::size_t>(cell[0] + n * (cell[1] + n * cell[2]))];
      }
    }
  CHECK(met == 0);
}

TEST_CASE("silhouettes: same for any thread count, and the errors say what came") {
  const std::vector<View> views{sparse_view(20, 20, 1), sparse_view(20, 20, 2), sparse_view(20, 20, 3)};
  const ScopedThreads serial(1);
  const auto one = training_pixels(views, 2);
  const ScopedThreads parallel(2);
  CHECK(training_pixels(views, 2) == one);
  CHECK_THROWS_WITH(training_pixels(views, -1), "[training_pixels] margin must not be negative, got -1");
}
