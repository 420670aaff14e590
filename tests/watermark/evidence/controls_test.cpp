#include <fieldmark/core/error.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/watermark/evidence/controls.h>

#include <algorithm>
#include <set>

#include "support/catch.h"
#include "watermark/small_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("controls: shuffled blocks are the image's squares in another order") {
  // 3 x 4 squares of 2 pixels, each with its own number, with a row and a column left over.
  Tensor<float> view_image({7, 9, 3});
  for (Index y = 0; y < 7; ++y)
    for (Index x = 0; x < 9; ++x)
      for (Index c = 0; c < 3; ++c)
        view_image[(y * 9 + x) * 3 + c] =
            static_cast<float>(1000 * (y / 2 * 4 + x / 2) + 100 * (y % 2) + 10 * (x % 2) + c);
  const Tensor<float> out = shuffled_blocks(view_image, 3, CounterRng(1), 0);
  REQUIRE(out.shape == Shape{6, 8, 3});
  std::set<int> seen;
  bool moved = false;
  for (Index y = 0; y < 6; ++y)
    for (Index x = 0; x < 8; ++x)
      for (Index c = 0; c < 3; ++c) {
        const int value = static_cast<int>(out[(y * 8 + x) * 3 + c]);
        CHECK(value % 1000 == 100 * (y % 2) + 10 * (x % 2) + c);
        CHECK(value / 1000 == static_cast<int>(out[(y / 2 * 2 * 8 + x / 2 * 2) * 3]) / 1000);
        seen.insert(value / 1000);
        moved = moved || value / 1000 != y / 2 * 4 + x / 2;
      }
  CHECK(seen.size() == 12);
  CHECK(moved);
  CHECK(shuffled_blocks(view_image, 3, CounterRng(1), 0).data == out.data);
  CHECK(shuffled_blocks(view_image, 3, CounterRng(1), 1).data != out.data);
}

TEST_CASE("controls: blocks that do not fit are refused") {
  CHECK_THROWS_WITH(shuffled_blocks(Tensor<float>({4, 9, 3}), 5, CounterRng(1), 0),
                    Contains("must have sides of at least 5 pixels, got shape"));
  CHECK_THROWS_WITH(shuffled_blocks(Tensor<float>({4, 9, 3}), 0, CounterRng(1), 0),
                    Contains("across must be at least 1, got 0"));
}

TEST_CASE("controls: an empty image, the field without its mark, and the images without their scene") {
  const Owner owner = small_owner();
  const std::vector<Tensor<float>> images(3, quantize8(uniform<float>({20, 24, 3}, 0, 1, 5)));
  const auto controls = built_in_controls(owner, images, 2, 9);
  REQUIRE(controls.size() == 3);
  CHECK(controls[0].name == "blank");
  REQUIRE(controls[0].images.size() == 1);
  CHECK(controls[0].images[0].shape == Shape{20, 24, 3});
  CHECK(std::all_of(controls[0].images[0].data.begin(), controls[0].images[0].data.end(),
                    [](float v) { return v == 1; }));
  CHECK(controls[1].name == "unmarked");
  REQUIRE(controls[1].images.size() == 2);
  nerf::Renderer renderer(owner.field);
  const auto cameras = nerf::make_cameras(owner.field.cameras, nerf::CameraSet::novel, 2, 0, 9 + 3);
  CHECK(controls[1].images[1].data == quantize8(renderer.render(cameras[1]).rgb).data);
  CHECK(controls[2].name == "shuffled");
  REQUIRE(controls[2].images.size() == 2);
  CHECK(controls[2].images[0].data != controls[2].images[1].data);
  for (const auto& control : controls) CHECK(control.meaning.size() > 20);
  const auto one = built_in_controls(owner, std::span(images).first(1), 9, 9);
  CHECK(one[1].images.size() == 1);
  CHECK(one[2].images.size() == 1);
  CHECK_THROWS_AS(built_in_controls(owner, {}, 2, 9), ValueError);
  CHECK_THROWS_AS(built_in_controls(owner, images, 0, 9), ValueError);
}
