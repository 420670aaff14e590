#include <fieldmark/engine/error.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/engine/resize.h>
#include <fieldmark/nerf/renderer.h>
#include <fieldmark/watermark/object_window.h>

#include <algorithm>
#include <cmath>

#include "nerf/small_field.h"
#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
// A dark disc on a plain background; a pixel is inside where its centre is.
Tensor<float> disc(Index height, Index width, double cx, double cy, double radius, float background = 1) {
  Tensor<float> image({height, width, 3}, background);
  for (Index y = 0; y < height; ++y)
    for (Index x = 0; x < width; ++x)
      if (std::hypot(static_cast<double>(x) + 0.5 - cx, static_cast<double>(y) + 0.5 - cy) < radius)
        for (Index c = 0; c < 3; ++c) image[(y * width + x) * 3 + c] = 0.4f;
  return image;
}

double middle_x(const Window& w) { return w.x + w.side / 2; }
double middle_y(const Window& w) { return w.y + w.side / 2; }
}  // namespace

TEST_CASE("object_window: finds a disc on white and on black to a pixel, with its margin") {
  for (float background : {1.f, 0.f}) {
    const Window w = object_window(disc(160, 200, 90, 70, 30, background), background);
    CHECK(middle_x(w) == Approx(90).margin(0.51));
    CHECK(middle_y(w) == Approx(70).margin(0.51));
    // The mean over 5 x 5 pixels sees an edge up to two pixels before it comes.
    CHECK(w.side / 1.08 >= 60);
    CHECK(w.side / 1.08 <= 64);
  }
}

TEST_CASE("object_window: moves and shrinks with the object") {
  const Tensor<float> picture = disc(160, 200, 90, 70, 40);
  const Window w = object_window(picture, 1);
  const Window moved = object_window(disc(160, 200, 97, 64, 40), 1);
  CHECK(moved.x - w.x == Approx(7).margin(1e-9));
  CHECK(moved.y - w.y == Approx(-6).margin(1e-9));
  CHECK(moved.side == Approx(w.side).margin(1e-9));
  const Window smaller = object_window(resize_area(picture, 120, 150), 1);
  CHECK(middle_x(smaller) == Approx(0.75 * middle_x(w)).margin(1));
  CHECK(middle_y(smaller) == Approx(0.75 * middle_y(w)).margin(1));
  CHECK(smaller.side == Approx(0.75 * w.side).margin(2.2));
}

TEST_CASE("object_window: does not take noise of deviation 0.1 for the object") {
  Tensor<float> picture = disc(160, 200, 90, 70, 40);
  const Window w = object_window(picture, 1);
  const CounterRng rng(3);
  for (Index i = 0; i < picture.size(); ++i)
    picture[i] = std::clamp(picture[i] + 0.1f * rng.normal4(static_cast<std::uint64_t>(i))[0], 0.f, 1.f);
  const Window noisy = object_window(picture, 1);
  CHECK(middle_x(noisy) == Approx(middle_x(w)).margin(1));
  CHECK(middle_y(noisy) == Approx(middle_y(w)).margin(1));
  CHECK(noisy.side == Approx(w.side).margin(2.2));
}

TEST_CASE("object_window: nothing and everything in sight give the square around the whole picture") {
  for (float value : {1.f, 0.3f}) {
    const Window w = object_window(Tensor<float>({30, 50, 3}, value), 1);
    CHECK(w.side == 50);
    CHECK(w.x == 0);
    CHECK(w.y == -10);
  }
}

TEST_CASE("object_window: a window is cut pixel for pixel, with background outside the picture") {
  Tensor<float> picture({6, 8, 3});
  for (Index i = 0; i < picture.size(); ++i) picture[i] = static_cast<float>(i) / 200;
  const auto pixel = [&](Index y, Index x, Index c) {
    return y < 0 || y >= 6 || x < 0 || x >= 8 ? 0.75f : picture[(y * 8 + x) * 3 + c];
  };
  const Tensor<float> part = cut_window(picture, {-2, 3, 5}, 5, 0.75f);
  REQUIRE(part.shape == Shape{5, 5, 3});
  bool same = true;
  for (Index y = 0; y < 5; ++y)
    for (Index x = 0; x < 5; ++x)
      for (Index c = 0; c < 3; ++c) same = same && part[(y * 5 + x) * 3 + c] == pixel(y + 3, x - 2, c);
  CHECK(same);
  // Half the size: means of 2 x 2 pixels.
  const Tensor<float> half = cut_window(picture, {1, 1, 4}, 2, 0.75f);
  const float mean = (pixel(1, 1, 0) + pixel(1, 2, 0) + pixel(2, 1, 0) + pixel(2, 2, 0)) / 4;
  CHECK(half[0] == Approx(mean).margin(1e-6));
  CHECK(cut_window(picture, {1, 1, 4}, 9, 0.75f).shape == Shape{9, 9, 3});
  CHECK(cut_window(Tensor<float>({6, 8, 3}, 0.5f), {1, 1, 4}, 9, 0.75f).data ==
        std::vector<float>(243, 0.5f));
}

TEST_CASE("object_window: the window's camera renders the pixels that are cut") {
  const nerf::RadianceField field = small_field();
  nerf::Renderer renderer(field);
  const nerf::Camera camera =
      nerf::make_camera(nerf::look_at({2, -2.5, 1}, {0, 0, 0}, {0, 0, 1}), 0.8, 40, 32);
  const Window window{7, -3, 24};
  const Tensor<float> cut = cut_window(renderer.render(camera).rgb, window, 24, 1);
  const nerf::Camera inside = window_camera(camera, window, 24);
  CHECK(inside.width == 24);
  CHECK(inside.height == 24);
  const Tensor<float> seen = renderer.render(inside).rgb;
  double worst = 0, spread = 0;
  for (Index i = 3 * 24 * 3; i < seen.size(); ++i) {  // the first three rows lie above the picture
    worst = std::max(worst, static_cast<double>(std::abs(seen[i] - cut[i])));
    spread = std::max(spread, static_cast<double>(std::abs(seen[i] - seen[3 * 24 * 3])));
  }
  CHECK(worst < 1e-4);
  CHECK(spread > 0.05);
  // At another size, the rays of the corners stay where they were.
  const nerf::Camera finer = window_camera(camera, window, 96);
  const nerf::Ray a = nerf::pixel_ray(inside, -0.5, 23.5), b = nerf::pixel_ray(finer, -0.5, 95.5);
  for (std::size_t k = 0; k < 3; ++k) CHECK(a.direction[k] == Approx(b.direction[k]).margin(1e-12));
}

TEST_CASE("object_window: errors name what is wrong") {
  CHECK_THROWS_AS(object_window(Tensor<float>({5, 5, 4}), 1), ShapeError);
  CHECK_THROWS_WITH(object_window(Tensor<float>({5, 5}), 1),
                    "[object_window] rgb must have rank 3 [H, W, 3], got shape [5, 5]");
  const Tensor<float> picture({5, 5, 3});
  CHECK_THROWS_AS(cut_window(picture, {0, 0, 0}, 4, 1), ValueError);
  CHECK_THROWS_AS(cut_window(picture, {0, 0, std::nan("")}, 4, 1), ValueError);
  CHECK_THROWS_WITH(cut_window(picture, {0, 0, 2}, 0, 1),
                    "[cut_window] window and size must be positive, got side 2.000000 and size 0");
}
