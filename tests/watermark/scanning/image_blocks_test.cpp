#include <fieldmark/core/error.h>
#include <fieldmark/watermark/scanning/image_blocks.h>

#include <cmath>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

// Fills a box with a pattern that has no plain row or column.
void paint_block(Tensor<float>& page, const PixelBox& box) {
  for (Index y = 0; y < box.height; ++y)
    for (Index x = 0; x < box.width; ++x)
      for (Index c = 0; c < 3; ++c)
        page[3 * ((box.y + y) * page.shape[1] + box.x + x) + c] =
            0.2f + 0.05f * static_cast<float>((x + 2 * y + 3 * c) % 5);
}

std::vector<PixelBox> boxes_of(const std::vector<ImageBlock>& blocks) {
  std::vector<PixelBox> found;
  for (const ImageBlock& block : blocks) found.push_back(block.box);
  return found;
}

}  // namespace

TEST_CASE("image_blocks: blocks on a page are found to the pixel, lines of text left out") {
  Tensor<float> page({900, 300, 3}, 0.97f);
  const PixelBox title{20, 10, 200, 12}, wide{30, 60, 240, 160}, left{15, 300, 120, 150},
      right{160, 310, 130, 90}, last{100, 700, 70, 80};
  for (const PixelBox& box : {title, wide, left, right, last}) paint_block(page, box);
  for (Index line = 0; line < 8; ++line) paint_block(page, {15, 480 + 20 * line, 270, 10});
  const ImageBlocks found = image_blocks(page, 64);
  CHECK(found.background[1] == Approx(0.97f));
  CHECK(found.all.box == PixelBox{15, 10, 275, 770});
  REQUIRE(found.all.parts.size() == 3);
  CHECK(boxes_of(found.all.parts) == std::vector<PixelBox>{wide, {15, 300, 275, 150}, last});
  CHECK(boxes_of(found.all.parts[1].parts) == std::vector<PixelBox>{left, right});
  CHECK(found.all.parts[0].parts.empty());
}

TEST_CASE("image_blocks: noise up to a tenth of the range does not close a gap, a thin gap does not divide") {
  Tensor<float> page({300, 640, 3}, 0.8f);
  for (Index i = 0; i < page.size(); ++i) page[i] += 0.02f * std::sin(static_cast<float>(i));
  paint_block(page, {10, 10, 200, 180});
  paint_block(page, {214, 10, 200, 180});  // four columns apart
  CHECK(boxes_of(image_blocks(page, 64).all.parts) ==
        std::vector<PixelBox>{{10, 10, 200, 180}, {214, 10, 200, 180}});
  paint_block(page, {213, 10, 2, 180});  // three
  CHECK(image_blocks(page, 64).all.parts.empty());
  CHECK(image_blocks(page, 64).all.box == PixelBox{10, 10, 404, 180});
}

TEST_CASE("image_blocks: one part among crumbs is the block itself, and nothing is nothing") {
  Tensor<float> page({300, 300, 3}, 1.f);
  CHECK(image_blocks(page, 8).all.box.area() == 0);
  paint_block(page, {2, 2, 5, 5});
  paint_block(page, {50, 60, 100, 110});
  const ImageBlock block = image_blocks(page, 8).all;
  CHECK(block.box == PixelBox{50, 60, 100, 110});
  CHECK(block.parts.empty());
}

TEST_CASE("image_blocks: an image without a plain background is one block") {
  Tensor<float> image({90, 120, 3});
  for (Index i = 0; i < image.size(); ++i) image[i] = static_cast<float>((i * 7919) % 1000) / 1000;
  const ImageBlock block = image_blocks(image, 8).all;
  CHECK(block.box == PixelBox{0, 0, 120, 90});
  CHECK(block.parts.empty());
}

TEST_CASE("image_blocks: errors say what is wrong") {
  CHECK_THROWS_AS(image_blocks(Tensor<float>({4, 4}), 1), ShapeError);
  CHECK_THROWS_AS(image_blocks(Tensor<float>({4, 4, 4}), 1), ShapeError);
  CHECK_THROWS_WITH(image_blocks(Tensor<float>({4, 4, 3}), 0),
                    "[image_blocks] least must be at least 1, got 0");
}
