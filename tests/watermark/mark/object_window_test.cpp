#include <fieldmark/core/error.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/imaging/resize.h>
#include <fieldmark/nerf/renderer.h>
#include <fieldmark/watermark/mark/object_window.h>

#include <algorithm>
#include <cmath>

#include "nerf/small_field.h"
#include "support/catch.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
// Returns a dark disc on a plain background; a pixel is inside if its centre is.
Tensor<float> disc(Index height, Index width, double cx, double cy, double radius, float background = 1) {
  Tensor<float> image({height, width, 3}, background);
  for (Index y = 0; y < height; ++y)
    for (Index x = 0; x < width; ++x)
      if (std::hypot(static_cast<double>(x) + 0.5 - cx, static_cast<double>(y) + 0.5 - cy) < radius)
        for (Index c = 0; c < 3; ++c) image[(y * width + x) * 3 + c] = 0.4f;
  return image;
}

double middle_x(const Window& w) { return w.x + w.width / 2; }
double middle_y(const Window& w) { return w.y + w.height / 2; }
}  // namespace

TEST_CASE("object_window: finds a disc on white and on black to a pixel, with its margin") {
  for (float background : {1.f, 0.f}) {
    const Window w = object_window(disc(160, 200, 90, 70, 30, background), background);
    CHECK(middle_x(w) == Approx(90).margin(0.51));
    CHECK(middle_y(w) == Approx(70).margin(0.51));
    // The mean over 5 x 5 pixels sees an edge up to two pixels early.
    CHECK(w.width / 1.08 >= 60);
    CHECK(w.width / 1.08 <= 64);
    CHECK(w.height == w.width);
  }
}

TEST_CASE("object_window: moves and shrinks with the object") {
  const Tensor<float> view_image = disc(160, 200, 90, 70, 40);
  const Window w = object_window(view_image, 1);
  const Window moved = object_window(disc(160, 200, 97, 64, 40), 1);
  CHECK(moved.x - w.x == Approx(7).margin(1e-9));
  CHECK(moved.y - w.y == Approx(-6).margin(1e-9));
  CHECK(moved.width == Approx(w.width).margin(1e-9));
  const Window smaller = object_window(resize_area(view_image, 120, 150), 1);
  CHECK(middle_x(smaller) == Approx(0.75 * middle_x(w)).margin(1));
  CHECK(middle_y(smaller) == Approx(0.75 * middle_y(w)).margin(1));
  CHECK(smaller.width == Approx(0.75 * w.width).margin(2.2));
}

TEST_CASE("object_window: does not take noise of deviation 0.1 for the object") {
  Tensor<float> view_image = disc(160, 200, 90, 70, 40);
  const Window w = object_window(view_image, 1);
  const CounterRng rng(3);
  for (Index i = 0; i < view_image.size(); ++i)
    view_image[i] =
        std::clamp(view_image[i] + 0.1f * rng.normal4(static_cast<std::uint64_t>(i))[0], 0.f, 1.f);
  const Window noisy = object_window(view_image, 1);
  CHECK(middle_x(noisy) == Approx(middle_x(w)).margin(1));
  CHECK(middle_y(noisy) == Approx(middle_y(w)).margin(1));
  CHECK(noisy.width == Approx(w.width).margin(2.2));
}

TEST_CASE("object_window: nothing and everything in sight give the square around the whole image") {
  for (float value : {1.f, 0.3f}) {
    const Window w = object_window(Tensor<float>({30, 50, 3}, value), 1);
    CHECK(w.width == 50);
    CHECK(w.height == 50);
    CHECK(w.x == 0);
    CHECK(w.y == -10);
  }
}

TEST_CASE("object_window: a window of another shape is the least around the object or the image") {
  const Tensor<float> view_image = disc(160, 200, 90, 70, 30);
  const Window square = object_window(view_image, 1), flat = object_window(view_image, 1, 1.6),
               upright = object_window(view_image, 1, 0.5);
  CHECK(flat.height == Approx(square.height));
  CHECK(flat.width == Approx(1.6 * square.height));
  CHECK(upright.width == Approx(square.width));
  CHECK(upright.height == Approx(2 * square.width));
  for (const Window& w : {flat, upright}) {
    CHECK(middle_x(w) == Approx(middle_x(square)));
    CHECK(middle_y(w) == Approx(middle_y(square)));
  }
  const Window whole = object_window(Tensor<float>({30, 50, 3}, 0.3f), 1, 50. / 30);
  CHECK(whole.x == Approx(0).margin(1e-12));
  CHECK(whole.y == Approx(0).margin(1e-12));
  CHECK(whole.width == Approx(50));
  CHECK(whole.height == Approx(30));
}

TEST_CASE("object_window: a window is cut pixel for pixel, with background outside the image") {
  Tensor<float> view_image({6, 8, 3});
  for (Index i = 0; i < view_image.size(); ++i) view_image[i] = static_cast<float>(i) / 200;
  const auto pixel = [&](Index y, Index x, Index c) {
    return y < 0 || y >= 6 || x < 0 || x >= 8 ? 0.75f : view_image[(y * 8 + x) * 3 + c];
  };
  const Tensor<float> part = cut_window(view_image, {-2, 3, 5, 5}, square_patch(5), 0.75f);
  REQUIRE(part.shape == Shape{5, 5, 3});
  bool same = true;
  for (Index y = 0; y < 5; ++y)
    for (Index x = 0; x < 5; ++x)
      for (Index c = 0; c < 3; ++c) same = same && part[(y * 5 + x) * 3 + c] == pixel(y + 3, x - 2, c);
  CHECK(same);
  // Half the size: means of 2 x 2 pixels.
  const Tensor<float> half = cut_window(view_image, {1, 1, 4, 4}, square_patch(2), 0.75f);
  const float mean = (pixel(1, 1, 0) + pixel(1, 2, 0) + pixel(2, 1, 0) + pixel(2, 2, 0)) / 4;
  CHECK(half[0] == Approx(mean).margin(1e-6));
  CHECK(cut_window(view_image, {1, 1, 4, 4}, square_patch(9), 0.75f).shape == Shape{9, 9, 3});
  CHECK(cut_window(Tensor<float>({6, 8, 3}, 0.5f), {1, 1, 4, 4}, square_patch(9), 0.75f).data ==
        std::vector<float>(243, 0.5f));
  // Twice as wide as high, at half the size.
  const Tensor<float> flat = cut_window(view_image, {1, 2, 4, 2}, {1, 2}, 0.75f);
  REQUIRE(flat.shape == Shape{1, 2, 3});
  for (Index x = 0; x < 2; ++x)
    CHECK(flat[3 * x] == Approx((pixel(2, 1 + 2 * x, 0) + pixel(2, 2 + 2 * x, 0) + pixel(3, 1 + 2 * x, 0) +
                                 pixel(3, 2 + 2 * x, 0)) /
                                4)
                             .margin(1e-6));
}

// Windows around a wide image are cut by columns where they are far higher than the patch: 200 lines for 4.
TEST_CASE("object_window: a window far larger than a wide or tall image has the bits of one cut whole") {
  const CounterRng rng(3);
  for (const Shape& shape : {Shape{5, 200, 3}, Shape{200, 5, 3}}) {
    Tensor<float> image(shape);
    for (Index i = 0; i < image.size(); ++i)
      image[i] = static_cast<float>(rng.bits(static_cast<std::uint64_t>(i))[0] % 256) / 255;
    const Index y0 = (200 - shape[0]) / 2, x0 = (200 - shape[1]) / 2;
    Tensor<float> whole({200, 200, 3}, 0.75f);
    for (Index y = 0; y < shape[0]; ++y)
      for (Index x = 0; x < shape[1]; ++x)
        for (Index c = 0; c < 3; ++c)
          whole[((y + y0) * 200 + x + x0) * 3 + c] = image[(y * shape[1] + x) * 3 + c];
    const Window window{static_cast<double>(-x0), static_cast<double>(-y0), 200, 200};
    for (const PatchSize& size : {square_patch(4), PatchSize{3, 7}})
      CHECK(cut_window(image, window, size, 0.75f).data == resize_area(whole, size.height, size.width).data);
  }
}

TEST_CASE("object_window: the window's camera renders the pixels that are cut") {
  const nerf::RadianceField field = small_field();
  nerf::Renderer renderer(field);
  const nerf::Camera camera =
      nerf::make_camera(nerf::look_at({2, -2.5, 1}, {0, 0, 0}, {0, 0, 1}), 0.8, 40, 32);
  const Window window{7, -3, 24, 24};
  const Tensor<float> cut = cut_window(renderer.render(camera).rgb, window, square_patch(24), 1);
  const nerf::Camera inside = window_camera(camera, window, square_patch(24));
  CHECK(inside.width == 24);
  CHECK(inside.height == 24);
  const Tensor<float> seen = renderer.render(inside).rgb;
  double worst = 0, spread = 0;
  for (Index i = 3 * 24 * 3; i < seen.size(); ++i) {  // the first three rows lie above the image
    raise_to(worst, static_cast<double>(std::abs(seen[i] - cut[i])));
    raise_to(spread, static_cast<double>(std::abs(seen[i] - seen[3 * 24 * 3])));
  }
  CHECK(worst < 1e-4);
  CHECK(spread > 0.05);
  // At another size, the corner rays stay where they were.
  const nerf::Camera finer = window_camera(camera, window, square_patch(96));
  const nerf::Ray a = nerf::pixel_ray(inside, -0.5, 23.5), b = nerf::pixel_ray(finer, -0.5, 95.5);
  for (std::size_t k = 0; k < 3; ++k) CHECK(a.direction[k] == Approx(b.direction[k]).margin(1e-12));
  // Another shape sees the same pixels through the corner rays.
  const nerf::Camera flat = window_camera(camera, {7, 5, 24, 12}, {12, 24});
  const Tensor<float> rows = renderer.render(flat).rgb;
  REQUIRE(rows.shape == Shape{12, 24, 3});
  for (Index i = 0; i < rows.size(); ++i)
    raise_to(worst, static_cast<double>(std::abs(rows[i] - seen[8 * 24 * 3 + i])));
  CHECK(worst < 1e-4);
}

TEST_CASE("object_window: errors name what is wrong") {
  CHECK_THROWS_AS(object_window(Tensor<float>({5, 5, 4}), 1), ShapeError);
  CHECK_THROWS_WITH(object_window(Tensor<float>({5, 5}), 1),
                    "[object_window] rgb must have rank 3 [H, W, 3], got shape [5, 5]");
  const Tensor<float> view_image({5, 5, 3});
  CHECK_THROWS_WITH(object_window(view_image, 1, 0), "[object_window] aspect must be positive, got 0");
  CHECK_THROWS_AS(object_window(view_image, 1, std::nan("")), ValueError);
  CHECK_THROWS_AS(cut_window(view_image, {0, 0, 0, 4}, square_patch(4), 1), ValueError);
  CHECK_THROWS_AS(cut_window(view_image, {0, 0, 4, std::nan("")}, square_patch(4), 1), ValueError);
  CHECK_THROWS_WITH(cut_window(view_image, {0, 0, 2, 3}, {0, 4}, 1),
                    "[cut_window] window and size must be positive, got 2 x 3 and 4 x 0");
}
