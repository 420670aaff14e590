#include "scene_look.h"

#include <fieldmark/core/error.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {

constexpr Index kWidth = 48, kHeight = 40;

// Colour and alpha of pixel (x, y) of view v.
using Paint = std::function<std::array<float, 4>(Index v, Index x, Index y)>;

std::vector<View> views_of(const Paint& paint, int count = 10) {
  std::vector<View> views;
  for (int v = 0; v < count; ++v) {
    View view{.camera = make_camera({1, 0, 0, 0.1 * v, 0, 1, 0, 0, 0, 0, 1, 4}, 0.8, kWidth, kHeight),
              .rgba = Tensor<float>({kHeight, kWidth, 4}),
              .name = {}};
    for (Index y = 0; y < kHeight; ++y)
      for (Index x = 0; x < kWidth; ++x) {
        const auto c = paint(v, x, y);
        std::copy(c.begin(), c.end(), view.rgba.data.data() + 4 * (y * kWidth + x));
      }
    views.push_back(std::move(view));
  }
  return views;
}

// True on a disc of varying position and size, like an object's silhouette.
bool on_object(Index v, Index x, Index y) {
  const double u = static_cast<double>(x) - 22 - static_cast<double>(v % 3) * 2,
               w = static_cast<double>(y) - 20;
  return u * u / 1.4 + w * w < 120 + 6 * static_cast<double>(v);
}

float texture(Index v, Index x, Index y) {
  return 0.5f + 0.45f * std::sin(static_cast<float>(x * (3 + v) + 7 * y));
}

std::array<float, 4> training_image(Index v, Index x, Index y) {
  const float t = texture(v, x, y);
  return {t, 1 - t, 0.5f * t, 1};
}

// True if (x, y) is within `margin` pixels of the image's border.
bool in_frame(Index x, Index y, Index margin) {
  return std::min({x, y, kWidth - 1 - x, kHeight - 1 - y}) < margin;
}

SceneType type_of(const Paint& paint) { return look_at_scene(views_of(paint), false).type; }

}  // namespace

TEST_CASE("scene_look: silhouettes in alpha are of an object") {
  const auto views = views_of([](Index v, Index x, Index y) -> std::array<float, 4> {
    const float t = texture(v, x, y);
    return {t, t, t, on_object(v, x, y) ? 1.f : 0.f};
  });
  const SceneLook look = look_at_scene(views, false);
  CHECK(look.type == SceneType::object);
  CHECK(look.reason == "100% of the pixels at the images' borders are transparent");
  CHECK(look_at_scene(views, true).type == SceneType::forward);
}

TEST_CASE("scene_look: training images are of a place, whatever their alpha has that is no silhouette") {
  CHECK(type_of(training_image) == SceneType::place);
  const auto with_alpha = [](auto transparent) {
    return [=](Index v, Index x, Index y) {
      auto c = training_image(v, x, y);
      if (transparent(v, x, y)) c[3] = 0;
      return c;
    };
  };
  CHECK(type_of(with_alpha([](Index v, Index x, Index y) { return v == 3 && x == 5 && y == 7; })) ==
        SceneType::place);
  CHECK(type_of(with_alpha([](Index, Index x, Index y) { return in_frame(x, y, 1); })) == SceneType::place);
  CHECK(type_of(with_alpha([](Index, Index x, Index y) { return in_frame(x, y, 5); })) == SceneType::place);
  // The round image of a fisheye lens.
  CHECK(type_of(with_alpha([](Index, Index x, Index y) {
          return std::hypot((static_cast<double>(x) - 23.5) / 24, (static_cast<double>(y) - 19.5) / 20) > 1;
        })) == SceneType::place);
  // A sky that was cut away.
  CHECK(type_of(with_alpha([](Index v, Index, Index y) { return y < 8 + v % 2; })) == SceneType::place);
}

TEST_CASE("scene_look: opaque objects before one colour, with noise, are plain") {
  const auto noise = uniform<float>({10, kHeight, kWidth, 3}, -2.f / 255, 2.f / 255, 4);
  const std::array<float, 3> green{0.2f, 0.9f, 0.3f};
  const auto views = views_of([&](Index v, Index x, Index y) -> std::array<float, 4> {
    const float t = texture(v, x, y);
    if (on_object(v, x, y)) return {t, t, t, 1};
    const float* n = noise.data.data() + 3 * ((v * kHeight + y) * kWidth + x);
    return {green[0] + n[0], green[1] + n[1], green[2] + n[2], 1};
  });
  const SceneLook look = look_at_scene(views, false);
  CHECK(look.type == SceneType::plain);
  for (std::size_t k = 0; k < 3; ++k) CHECK(std::abs(look.colour[k] - green[k]) < 1.f / 255);
  CHECK(look.tolerance > 2.f / 255);
  CHECK(look.tolerance < 5.f / 255);
  CHECK_THAT(look.reason, Contains("the images' borders have one colour, 51 2"));
}

TEST_CASE("scene_look: a frame of one colour around training images is no background") {
  CHECK(type_of([](Index v, Index x, Index y) {
          return in_frame(x, y, 3) ? std::array<float, 4>{0, 0, 0, 1} : training_image(v, x, y);
        }) == SceneType::place);
}

TEST_CASE("scene_look: borders of another colour in each image are of a place") {
  CHECK(type_of([](Index v, Index x, Index y) {
          const float g = 0.09f * static_cast<float>(v);
          return in_frame(x, y, 9) ? std::array<float, 4>{g, g, g, 1} : training_image(v, x, y);
        }) == SceneType::place);
}

TEST_CASE("scene_look: the background is cut out up to a pixel from the object, holes and highlights stay") {
  // A square of 20 pixels with a hole in the background's colour, and a highlight of two pixels through its
  // rim.
  View view = views_of(
      [](Index, Index x, Index y) -> std::array<float, 4> {
        const bool square = x >= 10 && x < 30 && y >= 10 && y < 30;
        const bool hole = x >= 16 && x < 24 && y >= 16 && y < 24;
        const bool highlight = y >= 18 && y < 20 && x < 20;
        return square && !hole && !highlight ? std::array<float, 4>{0.2f, 0.3f, 0.4f, 1}
                                             : std::array<float, 4>{1, 1, 1, 1};
      },
      1)[0];
  const Tensor<float> before = view.rgba;
  cut_out(view, {1, 1, 1}, 0.01f);
  for (Index y = 0; y < kHeight; ++y)
    for (Index x = 0; x < kWidth; ++x) {
      CAPTURE(x, y);
      const bool kept = x >= 9 && x < 31 && y >= 9 && y < 31;
      const Index p = 4 * (y * kWidth + x);
      CHECK(view.rgba[p + 3] == (kept ? 1 : 0));
      CHECK(std::equal(&view.rgba.data[static_cast<std::size_t>(p)],
                       &view.rgba.data[static_cast<std::size_t>(p)] + 3,
                       &before.data[static_cast<std::size_t>(p)]));
    }
}

TEST_CASE("scene_look: type, background and alpha of a data set follow the images, or what is asked for") {
  const auto before = [](float grey) {
    Dataset data;
    data.views = views_of([=](Index v, Index x, Index y) {
      return on_object(v, x, y) ? training_image(v, x, y) : std::array<float, 4>{grey, grey, grey, 1};
    });
    return data;
  };
  for (const float grey : {0.f, 0.2f, 0.9f, 1.f}) {
    Dataset data = before(grey);
    settle_scene(data, {}, false);
    CHECK(data.scene == SceneType::plain);
    CHECK(data.background == (grey > 0.5f ? Background::white : Background::black));
    CHECK(data.plain_colour == std::array<float, 3>{grey, grey, grey});
    CHECK(data.views[0].rgba[3] == 0);
    CHECK(data.views[0].rgba[4 * (20 * kWidth + 22) + 3] == 1);
  }
  Dataset place = before(1);
  settle_scene(place, {.scene = SceneType::place}, false);
  CHECK(place.scene == SceneType::place);
  CHECK(place.scene_reason == "as asked for");
  CHECK(place.background == Background::black);
  CHECK(place.views[0].rgba[3] == 1);
  CHECK(place.views[0].valid.empty());
  place.views[0].rgba[4 * 7 + 3] = 0.99f;
  settle_scene(place, {.scene = SceneType::place}, false);
  REQUIRE(place.views[0].valid.size() == kWidth * kHeight);
  CHECK(place.views[0].valid[7] == 0);
  CHECK(std::count(place.views[0].valid.begin(), place.views[0].valid.end(), 0) == 1);
  Dataset lit = before(0);
  settle_scene(lit, {.background = Background::white}, false);
  CHECK(lit.background == Background::white);

  Dataset flat = before(1);
  CHECK_THROWS_WITH(settle_scene(flat, {.scene = SceneType::forward}, false),
                    Contains("scene must not be forward (needs poses_bounds.npy"));
  flat.views[2].rgba[3] = 0.5f;
  CHECK_THROWS_WITH(settle_scene(flat, {.scene = SceneType::plain}, false),
                    Contains("scene must not be plain (the images have alpha)"));
  CHECK_THROWS_AS(settle_scene(flat, {.scene = SceneType::plain}, false), ValueError);
}
