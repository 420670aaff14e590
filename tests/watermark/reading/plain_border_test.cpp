#include "plain_border.h"
#include <fieldmark/core/error.h>

#include <algorithm>
#include <cmath>

#include "nerf/small_field.h"
#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
// Returns 12 x 12-pixel patches of arbitrary colours, whose corners of side 30 have another colour, with
// noise.
Tensor<float> with_corners(double noise) {
  const auto colours = uniform({90, 3}, 0, 0.8, 1);
  const auto u = uniform({100 * 120, 3}, -1.73 * noise, 1.73 * noise, 2);
  Tensor<float> image({100, 120, 3});
  for (Index p = 0; p < 100 * 120; ++p) {
    const Index y = p / 120, x = p % 120;
    const bool corner = std::min(y, 99 - y) + std::min(x, 119 - x) < 30;
    for (Index a = 0; a < 3; ++a)
      image[3 * p + a] =
          static_cast<float>((corner ? 1.0 : colours[3 * (y / 12 * 10 + x / 12) + a]) + u[3 * p + a]);
  }
  return image;
}
}  // namespace

TEST_CASE("plain_border: corners are found with a little around them, clean and under noise") {
  for (const double noise : {0.0, 0.1}) {
    const auto border = plain_border(with_corners(noise));
    Index corner = 0, missed = 0, more = 0, far = 0;
    for (Index p = 0; p < 100 * 120; ++p) {
      const Index y = p / 120, x = p % 120, away = std::min(y, 99 - y) + std::min(x, 119 - x);
      const bool is = border[static_cast<std::size_t>(p)] != 0;
      corner += away < 30;
      missed += away < 30 && !is;
      more += away >= 30 && is;
      far += away >= 50 && is;
    }
    CAPTURE(noise, corner, missed, more, far);
    CHECK(missed < (noise > 0 ? corner / 20 : corner / 100));
    CHECK(more < corner);
    CHECK(far == 0);
  }
}

TEST_CASE(
    "plain_border: a wedge of an image that was turned by two degrees is found where it is wider than a "
    "pixel") {
  Tensor<float> image = with_corners(0);
  for (Index p = 0; p < 100 * 120; ++p) {
    const Index y = p / 120, x = p % 120;
    if (std::min(y, 99 - y) + std::min(x, 119 - x) < 30)  // no corners
      for (Index a = 0; a < 3; ++a)
        image[3 * p + a] = 0.1f + 0.6f * static_cast<float>((x / 12 + y / 12) % 2);
    if (static_cast<double>(y) < 0.035 * static_cast<double>(60 - x))
      for (Index a = 0; a < 3; ++a) image[3 * p + a] = 1;
  }
  const auto border = plain_border(image);
  for (std::size_t x = 0; x < 38; ++x) CHECK(border[x] == 1);
}

TEST_CASE("plain_border: an image without one has none, one that is plain has nothing else") {
  CHECK(plain_border(Tensor<float>({20, 30, 3}, 0.5f)) == std::vector<std::uint8_t>(600, 1));
  CHECK(plain_border(Tensor<float>({0, 0, 3})).empty());
  Tensor<float> slope({160, 200, 3});  // no two places are alike: only the corners are marked
  for (Index p = 0; p < 160 * 200; ++p) {
    slope[3 * p] = static_cast<float>(p % 200) / 200;
    slope[3 * p + 1] = static_cast<float>(p / 200) / 160;
  }
  Index marked = 0;
  const auto border = plain_border(slope);
  for (Index p = 0; p < 160 * 200; ++p) {
    if (!border[static_cast<std::size_t>(p)]) continue;
    ++marked;
    CHECK(std::min(p / 200, 159 - p / 200) + std::min(p % 200, 199 - p % 200) < 60);
  }
  CHECK(marked > 1000);
  CHECK(marked < 160 * 200 / 10);
}

TEST_CASE("plain_border: at another size a place is taken from all that it covers, and a reach around") {
  std::vector<std::uint8_t> border(8 * 12);
  border[5 * 12 + 7] = 1;
  const auto half = border_at(border, 8, 12, 4, 6, 0), around = border_at(border, 8, 12, 4, 6, 1);
  for (Index y = 0; y < 4; ++y)
    for (Index x = 0; x < 6; ++x) {
      const auto p = static_cast<std::size_t>(6 * y + x);
      CHECK(half[p] == (y == 2 && x == 3));
      CHECK(around[p] == (std::abs(y - 2) <= 1 && std::abs(x - 3) <= 1));
    }
  CHECK_THROWS_AS(border_at(border, 8, 11, 4, 6, 0), ShapeError);
  CHECK_THROWS_AS(border_at(border, 8, 12, 0, 6, 0), ShapeError);
  CHECK_THROWS_AS(plain_border(Tensor<float>({4, 4, 1})), ShapeError);
}

TEST_CASE("plain_border: images of an object have none, those of a scene all around do") {
  nerf::RadianceField field = small_field();
  const Tensor<float> image = with_corners(0);
  CHECK(border_of(field, image).empty());
  field.space.kind = nerf::SpaceKind::contracted;
  CHECK(border_of(field, image) == plain_border(image));
}
