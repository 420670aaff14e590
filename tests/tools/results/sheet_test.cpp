#include <fieldmark/tools/results/sheet.h>

#include <fieldmark/core/error.h>

#include <cmath>

#include "support/catch.h"

using namespace fieldmark;
using results::ImagePair;

TEST_CASE("comparison_sheet has first, second and ten times the difference in a row for each pair",
          "[sheet]") {
  const std::vector<ImagePair> pairs{{Tensor<float>({2, 3, 3}, 0.2f), Tensor<float>({2, 3, 3}, 0.24f)},
                                     {Tensor<float>({2, 3, 3}, 0.6f), Tensor<float>({2, 3, 3}, 0.f)}};
  const auto sheet = results::comparison_sheet(pairs);
  REQUIRE(sheet.shape == Shape{2 * 2 + 4, 3 * 3 + 2 * 4, 3});
  const auto pixel = [&](Index row, Index column) { return sheet[(row * sheet.shape[1] + column) * 3]; };
  CHECK(pixel(0, 0) == 51 / 255.f);
  CHECK(pixel(0, 7) == 61 / 255.f);
  CHECK(std::abs(pixel(1, 14) - (0.5f + 10 * (61 - 51) / 255.f)) < 1e-6f);
  CHECK(pixel(3, 0) == 1);  // between the rows
  CHECK(pixel(6, 0) == 153 / 255.f);
  CHECK(pixel(6, 7) == 0);
  CHECK(pixel(6, 14) == 0);  // -5.5 clamped
}

TEST_CASE("comparison_sheet refuses images of two sizes", "[sheet]") {
  const ImagePair pair{Tensor<float>({2, 2, 3}), Tensor<float>({2, 3, 3})};
  CHECK_THROWS_AS(results::comparison_sheet(std::span(&pair, 1)), ShapeError);
  CHECK_THROWS_AS(results::comparison_sheet({}), ValueError);
}
