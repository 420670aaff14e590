#include <fieldmark/distort/jpeg_blocks.h>

#include <cmath>
#include <numbers>

#include "distort/support.h"
#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::distort;

TEST_CASE("jpeg_blocks: coefficients are sums with the cosines of T.81, A.3.3, and lead back") {
  const auto x = uniform<double>({64}, -128, 127, 5);
  JpegBlock levels;
  std::copy(x.data.begin(), x.data.end(), levels.begin());
  const JpegBlock c = jpeg_cosines(levels);
  const auto scale = [](int u) { return u == 0 ? std::numbers::sqrt2 / 4 : 0.5; };
  const auto wave = [](int x_, int u) { return std::cos((2 * x_ + 1) * u * std::numbers::pi / 16); };
  for (int v = 0; v < 8; ++v)
    for (int u = 0; u < 8; ++u) {
      double sum = 0;
      for (int i = 0; i < 64; ++i)
        sum += levels[static_cast<std::size_t>(i)] * wave(i / 8, v) * wave(i % 8, u);
      CHECK(std::abs(c[static_cast<std::size_t>(8 * v + u)] - scale(v) * scale(u) * sum) < 1e-10);
    }
  const JpegBlock back = from_jpeg_cosines(c);
  for (std::size_t i = 0; i < 64; ++i) CHECK(std::abs(back[i] - levels[i]) < 1e-10);
}

TEST_CASE("jpeg_blocks: steps are the base tables at 50, grow below and end at 1") {
  const JpegBlock luma = jpeg_steps(JpegComponent::luma, 50), chroma = jpeg_steps(JpegComponent::chroma, 50);
  CHECK(luma[0] == 16);
  CHECK(luma[63] == 99);
  CHECK(chroma[0] == 17);
  CHECK(chroma[63] == 99);
  CHECK(jpeg_steps(JpegComponent::luma, 25)[1] == 22);
  CHECK(jpeg_steps(JpegComponent::luma, 1)[0] == 255);
  for (const double step : jpeg_steps(JpegComponent::chroma, 100)) CHECK(step == 1);
  CHECK_THROWS_WITH(jpeg_steps(JpegComponent::luma, 0),
                    "[jpeg_steps] quality: must be in 1 to 100 (as libjpeg counts), got 0");
  CHECK_THROWS_AS(jpeg_steps(JpegComponent::luma, 101), ValueError);
}

TEST_CASE("jpeg_blocks: rows of the colour transform: grey has no chroma, luma of white is 1") {
  for (const int component : {0, 1, 2}) {
    const auto row = jpeg_colour_row(component);
    CHECK(std::abs(row[0] + row[1] + row[2] - (component == 0 ? 1 : 0)) < 1e-15);
  }
  CHECK(std::abs(jpeg_colour_row(1)[2] - 0.5) < 1e-15);
  CHECK(std::abs(jpeg_colour_row(2)[0] - 0.5) < 1e-15);
}
