#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>

#include "imaging/jpeg_bytes.h"
#include "imaging/video/video_samples.h"
#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;

#ifndef FIELDMARK_WITH_VIDEO
TEST_CASE("video_reader: without its libraries it names the packages") {
  CHECK_THROWS_WITH(VideoReader(from_base64(kWebm), "clip.webm"),
                    "clip.webm: videos need FFmpeg's libraries, which this build of Fieldmark lacks; install "
                    "libavformat-dev libavcodec-dev libswscale-dev and build again");
}
#endif

TEST_CASE("video_reader: frames are those of their times, in any order, in MP4 and WebM") {
  if (!video_or_skip()) return;
  for (const auto& bytes : {small_mp4(), from_base64(kWebm)}) {
    VideoReader video(bytes, "clip");
    CHECK(video.seconds() == Approx(0.8).margin(0.02));
    CHECK(video.oddity().empty());
    for (const int k : {0, 5, 3, 7, 6, 1, 4, 2, 2}) {
      const auto frame = video.read_at(0.1 * k + 0.05);
      INFO(k);
      CHECK(frame.time == Approx(0.1 * k).margin(0.002));
      CHECK(!frame.damaged);
      REQUIRE(frame.image.shape == Shape{16, 32, 3});
      CHECK(part_difference(frame.image, clip_frame(k)) < 0.04);
      CHECK(video.read_at(frame.time).image.data == frame.image.data);
    }
    CHECK(video.read_at(-5).time == 0);
    CHECK(video.read_at(1e9).time == Approx(0.7).margin(0.002));
  }
}

TEST_CASE("video_reader: next() goes through all frames, from the last read on") {
  if (!video_or_skip()) return;
  const auto bytes = small_mp4();
  VideoReader video(bytes, "clip");
  for (int k = 0; k < 8; ++k) {
    const auto frame = video.next();
    REQUIRE(frame);
    CHECK(frame->time == Approx(0.1 * k).margin(0.002));
  }
  CHECK(!video.next());
  video.read_at(0.35);
  CHECK(video.next()->time == Approx(0.4).margin(0.002));
}

TEST_CASE("video_reader: samples are even over the time, each frame once") {
  if (!video_or_skip()) return;
  const auto bytes = small_mp4();
  const VideoReader even(bytes, "clip");
  const auto close_to = [](const std::vector<double>& found, const std::vector<double>& expected) {
    REQUIRE(found.size() == expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) CHECK(found[i] == Approx(expected[i]).margin(0.002));
  };
  close_to(even.sample_times(1), {0.4});
  close_to(even.sample_times(2), {0.2, 0.6});
  close_to(even.sample_times(8), {0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7});
  close_to(even.sample_times(1000), {0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7});
  CHECK_THROWS_WITH(even.sample_times(0), Contains("count must be at least 1, got 0"));
  // The last frame begins at 3.4 s: most of the time shows three of the eight frames.
  const auto variable = from_base64(kMovVariable);
  VideoReader uneven(variable, "variable.mov");
  close_to(uneven.sample_times(3), {0.4, 1.3, 2.3});
  CHECK(part_difference(uneven.read_at(1.3).image, clip_frame(5)) < 0.06);
}

TEST_CASE("video_reader: a display matrix turns the frames") {
  if (!video_or_skip()) return;
  const auto bytes = from_base64(kMovTurned);
  VideoReader video(bytes, "turned.mov");
  const auto frame = video.read_at(0);
  REQUIRE(frame.image.shape == Shape{32, 16, 3});
  // Turned counterclockwise: the right side is on top.
  const auto at = [&](Index y, Index x, Index c) { return frame.image[(y * 16 + x) * 3 + c]; };
  CHECK(at(6, 3, 0) == Approx(250 / 255.0).margin(0.06));
  CHECK(at(6, 12, 1) == Approx(220 / 255.0).margin(0.06));
  CHECK(at(26, 8, 2) == Approx(200 / 255.0).margin(0.06));
}

TEST_CASE("video_reader: what is no video, or none any more, is one clear error") {
  if (!video_or_skip()) return;
  const TemporaryFolder folder;
  const auto fault = [&](const std::vector<std::byte>& bytes) -> std::string {
    write_file_atomically(folder / "x.mp4", std::span(bytes));
    try {
      VideoReader(folder / "x.mp4").read_at(0);
    } catch (const IoError& e) {
      return e.what();
    }
    return "";
  };
  CHECK_THAT(fault({}), Contains("x.mp4: expected an MP4, MOV or WebM video"));
  CHECK_THAT(fault(bytes_from({'n', 'o'})), Contains("x.mp4: expected an MP4, MOV or WebM video"));
  CHECK_THAT(fault(from_base64(kAudio)),
             Contains("x.mp4: expected a video, found a file without: only audio"));
  const auto mp4 = small_mp4();
  // An MP4 file has its index at the end.
  CHECK_THAT(fault({mp4.begin(), mp4.begin() + 300}), Contains("moov atom not found"));
  CHECK_THROWS_WITH(VideoReader(folder / "none.mp4"), Contains("none.mp4: open failed: No such file"));
  CHECK_THROWS_WITH(VideoReader(std::span<const std::byte>(), "memory"), Contains("memory: expected an MP4"));
  // A playlist names other files, which are never opened.
  CHECK_THAT(fault([] {
               const std::string_view list = "#EXTM3U\n#EXTINF:1,\n/etc/passwd\n";
               const auto bytes = std::as_bytes(std::span(list.data(), list.size()));
               return std::vector<std::byte>(bytes.begin(), bytes.end());
             }()),
             Contains("cannot be opened"));
}

TEST_CASE("video_reader: of a truncated file the frames that are there") {
  if (!video_or_skip()) return;
  const auto webm = from_base64(kWebm);
  const auto part = std::span(webm).first(webm.size() - 120);
  VideoReader video(part, "part.webm");
  CHECK(video.seconds() < 0.75);
  const auto times = video.sample_times(16);
  REQUIRE(times.size() >= 1);
  CHECK(times.size() < 8);
  CHECK(part_difference(video.read_at(0).image, clip_frame(0)) < 0.04);
}

TEST_CASE("video_reader: a damaged frame is told, and the others are read") {
  if (!video_or_skip()) return;
  auto mp4 = small_mp4();
  // Frames are in mdat, after x264's text; the last ones are overwritten.
  const std::string_view name = "mdat";
  const auto found = std::search(mp4.begin(), mp4.end(), std::as_bytes(std::span(name)).begin(),
                                 std::as_bytes(std::span(name)).end());
  REQUIRE(found != mp4.end());
  VideoReader whole(mp4, "whole");
  std::size_t size = 0;
  for (int i = 0; i < 4; ++i) size = size << 8 | std::to_integer<std::size_t>(*(found - 4 + i));
  for (std::ptrdiff_t i = 0; i < 60; ++i)
    *(found - 4 + static_cast<std::ptrdiff_t>(size) - 1 - i) = std::byte{0x5a};
  VideoReader video(mp4, "damaged");
  CHECK(part_difference(video.read_at(0).image, clip_frame(0)) < 0.04);
  std::size_t damaged = 0;
  const auto times = video.sample_times(8);
  for (const double time : times) {
    const auto frame = video.read_at(time);
    damaged += frame.damaged;
    if (!frame.damaged)
      CHECK(part_difference(frame.image, clip_frame(static_cast<int>(std::lround(10 * frame.time)))) < 0.04);
  }
  CHECK((damaged > 0 && damaged < times.size()));
}
