#include "crop_source.h"
#include <fieldmark/core/error.h>

#include <algorithm>
#include <cmath>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

TEST_CASE("crop_source: windows are parts of their images") {
  Tensor<float> image({20, 30, 3});
  for (Index i = 0; i < image.size(); ++i) image[i] = static_cast<float>(i) / 1800;
  const CropSource crops({image}, 1);
  for (std::uint64_t k = 0; k < 20; ++k) {
    const auto window = crops.crop(8, k);
    const Index at = std::lround(window[0] * 1800);
    REQUIRE(at % 3 == 0);
    CHECK(at / 3 / 30 <= 12);
    CHECK(at / 3 % 30 <= 22);
    for (Index y = 0; y < 8; ++y)
      for (Index x = 0; x < 24; ++x) CHECK(window[y * 24 + x] == image[at + y * 90 + x]);
  }
  CHECK(crops.crop(8, 3).data != crops.crop(8, 4).data);
  CHECK(crops.crop(40, 0).shape == Shape{40, 40, 3});
}

TEST_CASE("crop_source: half of the images are textures, and hardly any image is blank") {
  Tensor<float> image({64, 64, 3}, 1.f);  // white except for one corner
  for (Index y = 0; y < 32; ++y)
    for (Index x = 0; x < 32; ++x) image[(y * 64 + x) * 3] = static_cast<float>((x + y) % 2);
  const CropSource crops({image}, 1);
  int blank = 0, whole = 0;
  for (std::uint64_t k = 0; k < 60; ++k) {
    const auto crop = crops.image(16, k);
    const auto [low, high] = std::minmax_element(crop.data.begin(), crop.data.end());
    CHECK(*low >= 0);
    CHECK(*high <= 1);
    blank += *low == *high;
    whole += std::ranges::all_of(crop.data, [](float v) { return v == 0 || v == 1; });
  }
  CHECK(blank <= 6);
  CHECK(whole >= 18);
  CHECK(whole <= 42);
  const auto texture = generated_texture(16, CounterRng(2), 5);
  CHECK(texture.data == generated_texture(16, CounterRng(2), 5).data);
  CHECK(texture.data != generated_texture(16, CounterRng(2), 6).data);
}

TEST_CASE("crop_source: errors") {
  CHECK_THROWS_AS(CropSource({Tensor<float>({4, 4, 1})}, 1), ShapeError);
  CHECK_THROWS_WITH(CropSource({}, 1).crop(8, 0), "[crop_source] images must not be empty");
  CHECK(CropSource({}, 1).image(8, 0).shape == Shape{8, 8, 3});
  CHECK_THROWS_WITH(generated_texture(0, CounterRng(1), 0),
                    "[generated_texture] size must be at least 1, got 0");
}
