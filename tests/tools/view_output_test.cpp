#include "cli/view_output.h"

#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/video/video_reader.h>

#include "imaging/video/video_samples.h"
#include "support/catch.h"
#include "support/random.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::cli;

TEST_CASE("view_output: colours without their background, over which they are the view again", "[render]") {
  nerf::Rendering view{uniform<float>({2, 2, 3}, 0.5, 0.7, 1), Tensor<float>({2, 2})};
  view.opacity.data = {1, 0.5f, 0.75f, 0};
  for (Index c = 0; c < 3; ++c) view.rgb[9 + c] = 1;
  const Tensor<float> image = with_alpha(view, nerf::Background::white);
  REQUIRE(image.shape == Shape{2, 2, 4});
  for (Index i = 0; i < 4; ++i) {
    CHECK(image[4 * i + 3] == view.opacity[i]);
    for (Index c = 0; c < 3; ++c)
      CHECK(image[4 * i + c] * view.opacity[i] + 1 - view.opacity[i] == Approx(view.rgb[3 * i + c]));
  }
  CHECK(image[12] == 0);
  CHECK(with_alpha(view, nerf::Background::black)[4] == Approx(std::min(2 * view.rgb[3], 1.f)));
}

TEST_CASE("view_output: files of a folder", "[render]") {
  CHECK(is_video_path("a/b.MP4"));
  CHECK_FALSE(is_video_path("a/b.mp4/"));
  CHECK_FALSE(is_video_path("mp4"));
  const Tensor<float> a = uniform<float>({8, 12, 3}, 0, 1, 1), b = uniform<float>({8, 12, 3}, 0, 1, 2);
  for (const int n : {1, 2}) {
    const ScopedThreads scope(n);
    const TemporaryFolder folder;
    ViewOutput images(folder / "", 12, 8, 24);
    CHECK(images.add("a", a) == std::filesystem::path(folder / "") / "a.png");
    images.add("b", b);
    images.finish();
    CHECK(read_image(folder / "b.png").shape == b.shape);
  }
}

TEST_CASE("view_output: frames of a video", "[render]") {
  if (!video_or_skip()) return;
  const Tensor<float> a = uniform<float>({8, 12, 3}, 0, 1, 1), b = uniform<float>({8, 12, 3}, 0, 1, 2);
  for (const int n : {1, 2}) {
    const ScopedThreads scope(n);
    const TemporaryFolder folder;
    ViewOutput video(folder / "v.mp4", 12, 8, 5);
    video.add("a", a);
    CHECK(video.add("b", b) == std::filesystem::path(folder / "v.mp4"));
    CHECK_FALSE(std::filesystem::exists(folder / "v.mp4"));
    video.finish();
    VideoReader reader(folder / "v.mp4");
    std::vector<double> seconds;
    while (const auto frame = reader.next()) seconds.push_back(frame->time);
    REQUIRE(seconds.size() == 2);
    CHECK(seconds[1] - seconds[0] == Approx(0.2));
    CHECK_THROWS_AS(ViewOutput(folder / "v.mp4", 1, 8, 5), ValueError);
  }
}

TEST_CASE("view_output: a file that cannot be written is an error of the next call", "[render]") {
  for (const int n : {1, 2}) {
    const ScopedThreads scope(n);
    ViewOutput images("/nowhere/at/all", 2, 2, 24);
    CHECK_THROWS_AS((images.add("a", Tensor<float>({2, 2, 3})), images.finish()), IoError);
  }
}
