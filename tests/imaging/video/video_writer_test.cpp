#include <fieldmark/core/error.h>

#include "imaging/video/video_samples.h"
#include "support/catch.h"

using namespace fieldmark;

#ifndef FIELDMARK_WITH_VIDEO
TEST_CASE("video_writer: without its libraries it names the packages") {
  CHECK_THROWS_WITH(VideoWriter(32, 16), Contains("install libavformat-dev libavcodec-dev libswscale-dev"));
}
#endif

TEST_CASE("video_writer: equal images give equal bytes, and more of them at a lower rate factor") {
  if (!video_or_skip()) return;
  CHECK(small_mp4() == small_mp4());
  CHECK(small_mp4(0).size() > small_mp4(30).size());
}

TEST_CASE("video_writer: odd sides are filled up with the last row and column") {
  if (!video_or_skip()) return;
  VideoWriter writer(5, 3, {.crf = 0});
  Tensor<float> image({3, 5, 3});
  for (Index i = 0; i < image.size(); ++i) image[i] = static_cast<float>(i / 3 % 5) * 50.f / 255.f;
  writer.add(image);
  const auto file = writer.finish();
  VideoReader video(file, "odd");
  const auto frame = video.next();
  REQUIRE(frame);
  REQUIRE(frame->image.shape == Shape{4, 6, 3});
  for (Index y = 0; y < 4; ++y)
    for (Index x = 0; x < 6; ++x)
      CHECK(frame->image[(y * 6 + x) * 3] ==
            Approx(std::min<double>(static_cast<double>(x), 4) * 50 / 255).margin(0.02));
}

TEST_CASE("video_writer: what it cannot write is an error") {
  if (!video_or_skip()) return;
  CHECK_THROWS_WITH(VideoWriter(1, 16), Contains("width and height must be from 2 to 8192, got 1 x 16"));
  CHECK_THROWS_WITH(VideoWriter(16, 16, {.crf = 52}), Contains("crf must be from 0 to 51, got 52"));
  CHECK_THROWS_AS(VideoWriter(16, 16, {.frames_per_second = std::nan("")}), ValueError);
  VideoWriter writer(16, 8);
  CHECK_THROWS_WITH(writer.add(Tensor<float>({16, 8, 3})),
                    Contains("of shape [8, 16, 3], got shape [16, 8, 3]"));
  CHECK_THROWS_WITH(writer.finish(), Contains("at least one frame"));
}
