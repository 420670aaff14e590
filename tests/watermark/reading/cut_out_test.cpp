#include "cut_out.h"

#include <array>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using watermark::cut_out;

TEST_CASE("cut_out: keeps the pixels of the box") {
  const Tensor<float> image = uniform<float>({5, 7, 3}, 0, 1, 4);
  for (const auto& [top, bottom, left, right] :
       {std::array<Index, 4>{0, 5, 0, 7}, {1, 4, 2, 6}, {4, 5, 6, 7}, {0, 5, 3, 4}}) {
    const Tensor<float> part = cut_out(image, {top, bottom, left, right});
    REQUIRE(part.shape == Shape{bottom - top, right - left, 3});
    for (Index y = top; y < bottom; ++y)
      for (Index x = left; x < right; ++x)
        for (Index c = 0; c < 3; ++c)
          CHECK(part[((y - top) * (right - left) + x - left) * 3 + c] == image[(y * 7 + x) * 3 + c]);
  }
}

TEST_CASE("cut_out: a box that ends where it starts, or before, is empty") {
  const Tensor<float> image = uniform<float>({5, 7, 3}, 0, 1, 4);
  CHECK(cut_out(image, {2, 2, 0, 7}).shape == Shape{0, 7, 3});
  CHECK(cut_out(image, {0, 5, 9, 7}).shape == Shape{5, 0, 3});
  CHECK(cut_out(image, {7, 5, 9, 7}).size() == 0);
}
