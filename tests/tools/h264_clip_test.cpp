#include "cli/h264_clip.h"

#include <fieldmark/core/error.h>
#include <fieldmark/imaging/image.h>

#include "imaging/video/video_samples.h"
#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("h264_clip: as many images come out as went in, in order and in their size") {
  if (!video_or_skip()) return;
  cli::H264Clip clip(10), coarse(40);
  for (auto* to : {&clip, &coarse})
    for (int k = 0; k < 8; ++k) to->add(clip_frame(k), "k");
  double loss = 0, coarse_loss = 0;
  for (int k = 0; k < 8; ++k) {
    const auto image = clip.next(), worse = coarse.next();
    REQUIRE((image && worse));
    CHECK(image->shape == Shape{16, 32, 3});
    CHECK(part_difference(*image, clip_frame(k)) < 0.04);
    CHECK(quantize8(*image).data == image->data);
    loss += part_difference(*image, clip_frame(k)), coarse_loss += part_difference(*worse, clip_frame(k));
  }
  CHECK(loss < coarse_loss);
  CHECK(!clip.next());
}

TEST_CASE("h264_clip: odd sides stay, and sizes that differ are an error") {
  if (!video_or_skip()) return;
  cli::H264Clip clip(5);
  clip.add(Tensor<float>({7, 5, 3}, 0.4f), "first");
  CHECK_THROWS_WITH(
      clip.add(Tensor<float>({5, 7, 3}, 0.4f), "b.png"),
      "b.png: expected an image of 5 x 7 pixels as the first of the clip, found 7 x 5; h264 takes images "
      "of one size");
  const auto image = clip.next();
  REQUIRE(image);
  CHECK(image->shape == Shape{7, 5, 3});
  for (const float x : image->data) CHECK(x == Approx(0.4).margin(0.01));
  CHECK_THROWS_AS(cli::H264Clip(52), ValueError);
  CHECK(!cli::H264Clip(20).next());
}
