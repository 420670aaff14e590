#include "outline_match.h"

#include <cmath>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

constexpr Window kWindow{6, 4, 16, 12};

Tensor<float> render() { return uniform<float>({24, 30, 3}, 0, 1, 4); }

// Returns an opacity of 1 but for the left part of the window.
Tensor<float> opacity(Index left) {
  Tensor<float> x({24, 30, 3}, 1);
  for (Index i = 0; i < x.size(); ++i)
    if (i / 3 % 30 < left) x[i] = 0;
  return x;
}

// Returns noise in which `rgb`, of half its contrast, begins at a row and a column.
Tensor<float> hidden(const Tensor<float>& rgb, const Window& part, Index row, Index column) {
  Tensor<float> image = uniform<float>({40, 50, 3}, 0, 1, 5);
  const auto top = static_cast<Index>(part.y), left = static_cast<Index>(part.x);
  for (Index y = 0; y < static_cast<Index>(part.height); ++y)
    for (Index x = 0; x < static_cast<Index>(part.width); ++x)
      for (Index c = 0; c < 3; ++c)
        image[((row + y) * 50 + column + x) * 3 + c] =
            0.2f + 0.5f * rgb[((top + y) * rgb.shape[1] + left + x) * 3 + c];
  return image;
}

// Returns the likeness by its definition, in double.
double likeness(const Tensor<float>& rgb, const Window& part, const Tensor<float>& image, Index row,
                Index column, Index left) {
  double ti = 0, tt = 0, ii = 0;
  for (Index c = 0; c < 3; ++c) {
    std::vector<double> t, i;
    for (Index y = 0; y < static_cast<Index>(part.height); ++y)
      for (Index x = 0; x < static_cast<Index>(part.width); ++x) {
        const Index at_x = static_cast<Index>(part.x) + x, at_y = static_cast<Index>(part.y) + y;
        if (at_x < left) continue;
        t.push_back(static_cast<double>(rgb[(at_y * rgb.shape[1] + at_x) * 3 + c]));
        i.push_back(static_cast<double>(image[((row + y) * image.shape[1] + column + x) * 3 + c]));
      }
    double mean_t = 0, mean_i = 0;
    for (std::size_t k = 0; k < t.size(); ++k) {
      mean_t += t[k] / static_cast<double>(t.size());
      mean_i += i[k] / static_cast<double>(t.size());
    }
    for (std::size_t k = 0; k < t.size(); ++k) {
      ti += (t[k] - mean_t) * (i[k] - mean_i);
      tt += (t[k] - mean_t) * (t[k] - mean_t);
      ii += (i[k] - mean_i) * (i[k] - mean_i);
    }
  }
  return ti / std::sqrt(tt * ii);
}

}  // namespace

TEST_CASE("outline_match: a part is found where it is hidden, whatever its gain and offset") {
  for (const Index left : {0, 12}) {
    CAPTURE(left);
    const auto outline = outline_of(render(), opacity(left), kWindow, 16, 40);
    REQUIRE(outline);
    CHECK(outline->width == 16);
    CHECK(outline->height == 12);
    CHECK(std::ssize(outline->x) == (left == 0 ? 16 : 10) * 12);
    const OutlineMatch found = best_match(*outline, resized_image(hidden(render(), kWindow, 21, 30), 1));
    CHECK(found.row == 21);
    CHECK(found.column == 30);
    CHECK(found.likeness == Approx(1).margin(1e-4));
  }
}

TEST_CASE("outline_match: the likeness is a correlation without the means of the channels") {
  const Tensor<float> image = uniform<float>({12, 16, 3}, 0, 1, 9);
  for (const Index left : {0, 12}) {
    const auto outline = outline_of(render(), opacity(left), kWindow, 16, 40);
    REQUIRE(outline);
    const OutlineMatch only = best_match(*outline, resized_image(image, 1));
    CHECK(only.likeness == Approx(likeness(render(), kWindow, image, 0, 0, left)).margin(1e-4));
  }
}

TEST_CASE("outline_match: places further than the reach do not count, nor any beyond the image") {
  const auto outline = outline_of(render(), opacity(0), kWindow, 16, 40);
  REQUIRE(outline);
  const ResizedImage image = resized_image(hidden(render(), kWindow, 21, 30), 1);
  CHECK(best_match_near(*outline, image, 19, 32, 2).likeness == Approx(1).margin(1e-4));
  CHECK(best_match_near(*outline, image, 18, 30, 2).likeness < 0.5);
  const OutlineMatch corner = best_match_near(*outline, image, 100, 100, 80);
  CHECK(corner.likeness > -1);
  CHECK((corner.row >= 20 && corner.row <= 40 - 12));
  CHECK((corner.column >= 20 && corner.column <= 50 - 16));
  CHECK(best_match_near(*outline, image, 100, 100, 3).likeness == -1);
  CHECK(best_match(*outline, resized_image(Tensor<float>({11, 50, 3}, 0.5f), 1)).likeness == -1);
}

TEST_CASE("outline_match: plain parts, small parts and plain places look like nothing") {
  CHECK_FALSE(outline_of(Tensor<float>({24, 30, 3}, 0.5f), opacity(0), kWindow, 16, 40));
  CHECK_FALSE(outline_of(render(), opacity(0), kWindow, 16, 16 * 12 + 1));
  CHECK(outline_of(render(), opacity(0), kWindow, 16, 16 * 12));
  const auto outline = outline_of(render(), opacity(0), kWindow, 16, 40);
  REQUIRE(outline);
  CHECK(best_match(*outline, resized_image(Tensor<float>({40, 50, 3}, 0.5f), 1)).likeness == -1);
}

TEST_CASE("outline_match: a smaller image has the means of its pixels' areas") {
  const Tensor<float> image = uniform<float>({10, 20, 3}, 0, 1, 7);
  const ResizedImage half = resized_image(image, 0.5);
  CHECK(half.height == 5);
  CHECK(half.width == 10);
  CHECK(half.zoom_x == 0.5);
  double squares = 0;
  for (Index c = 0; c < 3; ++c) {
    const float mean = (image[c] + image[3 + c] + image[60 + c] + image[63 + c]) / 4;
    CHECK(half.plane[static_cast<std::size_t>(c)][0] == Approx(mean));
    squares += static_cast<double>(mean) * static_cast<double>(mean);
  }
  CHECK(half.squares[0] == Approx(squares));
}
