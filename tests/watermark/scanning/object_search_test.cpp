#include <fieldmark/distort/distortion.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/watermark/scanning/object_search.h>

#include <array>
#include <cmath>

#include "support/catch.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

constexpr ObjectSearchOptions kFewViews{.views = 60, .size = 48};

// Returns waves of many colours.
Tensor<float> waves(Index h, Index w) {
  Tensor<float> image({h, w, 3});
  for (Index p = 0; p < h * w; ++p)
    for (Index c = 0; c < 3; ++c)
      image[3 * p + c] =
          0.5f + 0.4f * std::sin(0.21f * static_cast<float>(p % w) * static_cast<float>(c + 1) +
                                 0.13f * static_cast<float>(p / w) * static_cast<float>(4 - c));
  return image;
}

struct Scene {
  Tensor<float> image;
  nerf::Camera camera;  // of the object before it was moved
};

// Returns the object at its size in a view of 80 pixels, `left` and `top` pixels into waves.
Scene object_in_waves(std::uint64_t seed, Index left, Index top) {
  Scene scene{waves(150, 200),
              nerf::make_cameras(tiny_field().cameras, nerf::CameraSet::novel, 1, 80, seed).front()};
  nerf::Renderer renderer(tiny_field());
  const nerf::Rendering view = renderer.render(scene.camera);
  const float level = nerf::background_value(tiny_field().background);
  for (Index y = 0; y < view.rgb.shape[0]; ++y)
    for (Index x = 0; x < view.rgb.shape[1]; ++x) {
      const Index from = y * view.rgb.shape[1] + x, to = (top + y) * 200 + left + x;
      const float a = view.opacity[from];
      for (Index c = 0; c < 3; ++c) {
        float& pixel = scene.image[3 * to + c];
        pixel = view.rgb[3 * from + c] - (1 - a) * level + (1 - a) * pixel;
      }
    }
  return scene;
}

// Returns the angle between two viewing directions, degrees.
double angle(const nerf::Camera& a, const nerf::Camera& b) {
  const auto u = a.forward(), v = b.forward();
  return std::acos(std::min(1., u[0] * v[0] + u[1] * v[1] + u[2] * v[2])) * 180 / 3.14159265358979;
}

}  // namespace

TEST_CASE("object_search: an object before waves is found, from a camera nearby") {
  const Owner owner = tiny_owner();
  const ObjectSearch search(owner, kFewViews);
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    CAPTURE(seed);
    const Scene scene = object_in_waves(seed, 90, 40);
    const auto places = search.find(scene.image, {4}, {4});
    REQUIRE(places.size() == 8);       // four of the whole object, four of quarters
    CHECK(places[0].likeness > 0.55);  // 0.62 to 0.80; 60 views are far apart
    double nearest = 180;
    for (const ObjectPlace& place : places) {
      CHECK(place.camera.width == 200);
      CHECK(place.camera.height == 150);
      const double x = place.window.x + place.window.width / 2, y = place.window.y + place.window.height / 2;
      if (std::abs(x - 130) < 30 && std::abs(y - 80) < 30)
        nearest = std::min(nearest, angle(place.camera, scene.camera));
    }
    CHECK(nearest < 25);
    for (std::size_t i = 0; i < 8; ++i) {
      CHECK(places[i].whole == (i < 4));
      if (i % 4 > 0) CHECK(places[i].likeness <= places[i - 1].likeness);
    }
  }
}

TEST_CASE("object_search: gain, offset and the number of threads change nothing that is found") {
  const Owner owner = tiny_owner();
  const ObjectSearch search(owner, kFewViews);
  Tensor<float> image = object_in_waves(1, 90, 40).image;
  const auto as_it_is = search.find(image, {2}, {2});
  {
    const ScopedThreads one(1);
    const auto again = ObjectSearch(owner, kFewViews).find(image, {2}, {2});
    REQUIRE(again.size() == 4);
    for (std::size_t i = 0; i < 4; ++i) {
      CHECK(again[i].likeness == as_it_is[i].likeness);
      CHECK(again[i].camera.pose == as_it_is[i].camera.pose);
      CHECK(again[i].window.x == as_it_is[i].window.x);
      CHECK(again[i].window.width == as_it_is[i].window.width);
      CHECK(again[i].whole == as_it_is[i].whole);
    }
  }
  for (Index i = 0; i < image.size(); ++i) image[i] = 0.6f * image[i] + 0.2f;
  const auto faded = search.find(image, {1}, {1});
  REQUIRE(faded.size() == 2);
  CHECK(faded[0].likeness == Approx(as_it_is[0].likeness).epsilon(1e-3));
  CHECK(faded[0].camera.pose == as_it_is[0].camera.pose);
}

TEST_CASE("object_search: places are as large as is wanted, and as many") {
  const Owner owner = tiny_owner();
  const ObjectSearch search(owner, kFewViews);
  const Tensor<float> image = object_in_waves(2, 90, 40).image;
  const auto places = search.find(image, {3, 60}, {5, 35});
  REQUIRE(places.size() == 8);
  for (const ObjectPlace& place : places) {
    CAPTURE(place.whole, place.window.width, place.window.height);
    CHECK(std::max(place.window.width, place.window.height) >= (place.whole ? 60 : 35));
  }
  CHECK(search.find(image, {0}, {2}).size() == 2);
  CHECK(search.find(image, {3, 1000}, {3, 1000}).empty());
}

namespace {

// Returns the overlap of two windows as a share of their union.
double overlap(const Window& a, const Window& b) {
  const double across = std::min(a.x + a.width, b.x + b.width) - std::max(a.x, b.x),
               down = std::min(a.y + a.height, b.y + b.height) - std::max(a.y, b.y);
  if (across <= 0 || down <= 0) return 0;
  return across * down / (a.width * a.height + b.width * b.height - across * down);
}

struct Quarter {
  Tensor<float> image;
  Window window;  // around it
};

// Returns a quarter of the object in a novel view, before shapes.
Quarter quarter_before_shapes(std::uint64_t seed) {
  const auto camera = nerf::make_cameras(tiny_field().cameras, nerf::CameraSet::novel, 1, 200, seed).front();
  nerf::Renderer renderer(tiny_field());
  const float level = nerf::background_value(tiny_field().background);
  distort::PixelMap source;
  Quarter quarter{
      distort::apply_distortion(distort::parse_distortion("part_0.8"), quantize8(renderer.render(camera).rgb),
                                CounterRng(1, 1), seed, std::array{level, level, level}, &source),
      {}};
  const distort::PixelMap to = source.inverse();
  const auto first = to(source.kept[0], source.kept[1]), last = to(source.kept[2], source.kept[3]);
  quarter.window = {first[0] + 0.5, first[1] + 0.5, last[0] - first[0], last[1] - first[1]};
  return quarter;
}

}  // namespace

TEST_CASE("object_search: a quarter of the object's pixels is found before shapes") {
  const Owner owner = tiny_owner();
  const ObjectSearch search(owner, {.views = 120});
  Index found = 0;
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u, 5u, 6u}) {
    const Quarter quarter = quarter_before_shapes(seed);
    double most = 0;
    for (const ObjectPlace& place : search.find(quarter.image, {0}, {10, 30}))
      most = std::max(most, overlap(place.window, quarter.window));
    found += most > 0.5;
  }
  CHECK(found >= 4);
}

TEST_CASE("object_search: a plain image looks like nothing") {
  const Owner owner = tiny_owner();
  CHECK(ObjectSearch(owner, kFewViews).find(Tensor<float>({64, 64, 3}, 0.4f), {4}, {4}).empty());
}

TEST_CASE("object_search: errors name what is wrong") {
  const Owner owner = tiny_owner();
  CHECK_THROWS_WITH(ObjectSearch(owner, {.views = 0}),
                    "[object_search] views and size must be at least 1 and 24, got 0 and 96");
  const ObjectSearch search(owner, {.views = 1, .size = 48});
  CHECK_THROWS_WITH(search.find(Tensor<float>({64, 64, 3}), {1}, {1, -2}),
                    "[object_search] count and least must be at least 0, got 1 and -2");
  CHECK_THROWS_AS(search.find(Tensor<float>({64, 64}), {1}, {1}), ShapeError);
  CHECK_THROWS_AS(search.find(Tensor<float>({15, 64, 3}), {1}, {1}), ShapeError);
}
