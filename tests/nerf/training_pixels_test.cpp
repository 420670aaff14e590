#include "training_pixels.h"
#include <fieldmark/engine/parallel.h>

#include <cmath>
#include <cstdlib>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
View sparse_view(Index width, Index height, unsigned seed) {
  View view;
  view.camera = make_camera(look_at({0, -3, 1}, {0, 0, 0}, {0, 0, 1}), 0.7, width, height);
  view.rgba = Tensor<float>({height, width, 4});
  const auto u = uniform({height * width}, 0, 1, seed);
  for (Index p = 0; p < height * width; ++p) view.rgba[4 * p + 3] = u[p] < 0.01 ? 0.5f : 0.f;
  return view;
}
}  // namespace

TEST_CASE("training_pixels: exactly those with alpha within the margin") {
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

TEST_CASE("training_pixels: no ray outside the margin meets a cell of the hull") {
  std::vector<View> views;
  for (int k = 0; k < 5; ++k) {
    View view;
    const double angle = 1.3 * k;
    view.camera = make_camera(look_at({3 * std::cos(angle), 3 * std::sin(angle), 1.0}, {0, 0, 0}, {0, 0, 1}),
                              1.5, 64, 64);  // sees all of the cube
    view.rgba = Tensor<float>({64, 64, 4});
    for (Index y = 28; y < 36; ++y)
      for (Index x = 27; x < 38; ++x) view.rgba[4 * (64 * y + x) + 3] = 1;
    views.push_back(view);
  }
  const Bounds bounds{{-1, -1, -1}, 2};
  const Index n = 32;
  std::vector<Silhouette> silhouettes;
  for (const View& v : views) silhouettes.push_back({v.camera, &v.rgba});
  const auto hull = visual_hull(silhouettes, bounds, n);
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

TEST_CASE("training_pixels: same for any thread count, and the errors say what came") {
  const std::vector<View> views{sparse_view(20, 20, 1), sparse_view(20, 20, 2), sparse_view(20, 20, 3)};
  const int before = threads();
  set_threads(1);
  const auto one = training_pixels(views, 2);
  set_threads(2);
  CHECK(training_pixels(views, 2) == one);
  set_threads(before);
  CHECK_THROWS_WITH(training_pixels(views, -1), "[training_pixels] margin must not be negative, got -1");
}
