#include "jpeg_planes.h"

#include <algorithm>
#include <cmath>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

// Doubles a line as decoders do: 3/4 of the nearest value and 1/4 of the next nearest one.
double doubled(Index i, Index n, auto value) {
  const Index nearest = i / 2, next = i % 2 == 0 ? nearest - 1 : nearest + 1;
  return 0.75 * value(nearest) + 0.25 * value(next < 0 || next >= n ? nearest : next);
}

}  // namespace

TEST_CASE("jpeg_planes: a decoder's smooth chroma is inverted, plain means are not") {
  constexpr Index h = 7, w = 9;
  const Tensor<float> half = uniform<float>({h, w}, 0, 1, 3);
  Tensor<float> image({2 * h, 2 * w, 3});
  for (Index p = 0; p < 4 * h * w; ++p)
    image[3 * p + 2] = static_cast<float>(doubled(p / (2 * w), h, [&](Index y) {
      return doubled(p % (2 * w), w, [&](Index x) { return static_cast<double>(half[y * w + x]); });
    }));
  const JpegPlane decoded = decoded_component(image, 1, 2), plain = component_of(image, 1, 2);
  REQUIRE(decoded.height == h);
  REQUIRE(decoded.width == w);
  const double blue = 255 * distort::jpeg_colour_row(1)[2];
  double off = 0;
  for (std::size_t i = 0; i < decoded.level.size(); ++i) {
    const double want = blue * static_cast<double>(half[static_cast<Index>(i)]);
    CHECK(std::abs(decoded.level[i] - want) < 1e-4);
    off = std::max(off, std::abs(plain.level[i] - want));
  }
  CHECK(off > 5);
}

TEST_CASE("jpeg_planes: blocks begin at the first whole one, and only those that are used are computed") {
  Tensor<float> image({19, 26, 3}, 0.5f);
  for (Index y = 3; y < 11; ++y)
    for (Index x = 2; x < 10; ++x)
      for (Index c = 0; c < 3; ++c) image[3 * (y * 26 + x) + c] = 1;
  const Tensor<float> part = from_first_block(image, {.left = 2, .top = 3});
  REQUIRE(part.shape == Shape{16, 24, 3});
  const JpegPlane luma = component_of(part, 0, 1);
  const auto all = jpeg_coefficients(luma, 128);
  REQUIRE(all.size() == 6);
  CHECK(std::abs(all[0][0] - 8 * 127) < 1e-3);
  CHECK(std::abs(all[1][0] + 4) < 1e-3);
  const auto some = jpeg_coefficients(luma, 128, std::vector<double>{0, 0, 1, 0, 0.5, 0});
  for (std::size_t b = 0; b < 6; ++b) CHECK(some[b] == (b == 2 || b == 4 ? all[b] : distort::JpegBlock{}));
}
