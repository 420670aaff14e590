#include "ffmpeg.h"

#include <cstdlib>

#include "imaging/video/video_samples.h"
#include "support/catch.h"

#ifdef FIELDMARK_WITH_VIDEO
using namespace fieldmark;

TEST_CASE("ffmpeg: display matrices have EXIF's names") {
  // Columns as in ISO/IEC 14496-12: (x, y) to (a x + c y, b x + d y), y down.
  const auto orientation = [](int a, int b, int c, int d) {
    const std::int32_t one = 1 << 16, matrix[9] = {a * one, b * one, 0, c * one, d * one, 0, 0, 0, 1 << 30};
    return ffmpeg::orientation_of(matrix);
  };
  CHECK(ffmpeg::orientation_of(nullptr) == 1);
  CHECK(orientation(1, 0, 0, 1) == 1);
  CHECK(orientation(-1, 0, 0, 1) == 2);
  CHECK(orientation(-1, 0, 0, -1) == 3);
  CHECK(orientation(1, 0, 0, -1) == 4);
  CHECK(orientation(0, 1, 1, 0) == 5);
  CHECK(orientation(0, 1, -1, 0) == 6);  // clockwise: right moves to the bottom, bottom to the left
  CHECK(orientation(0, -1, -1, 0) == 7);
  CHECK(orientation(0, -1, 1, 0) == 8);
}

TEST_CASE("ffmpeg: errors have a text, FFmpeg's own message first") {
  if (!video_or_skip()) return;
  const auto av_log = reinterpret_cast<void (*)(void*, int, const char*, ...)>(
      ffmpeg::address(ffmpeg::Library::util, "av_log"));
  ffmpeg::take_messages();
  CHECK(ffmpeg::reason(AVERROR_INVALIDDATA) == "Invalid data found when processing input");
  av_log(nullptr, AV_LOG_WARNING, "passed over\n");
  av_log(nullptr, AV_LOG_ERROR, "moov atom not found\n");
  av_log(nullptr, AV_LOG_ERROR, "a consequence\n");
  CHECK(ffmpeg::reason(AVERROR_INVALIDDATA) == "moov atom not found");
  ffmpeg::take_messages();
  CHECK(ffmpeg::reason(AVERROR_EOF) == "End of file");
}

TEST_CASE("ffmpeg: what a damaged file asks for is bounded") {
  if (!video_or_skip()) return;
  ffmpeg::limit_memory();
  CHECK(ffmpeg::av_malloc((std::size_t{1} << 30) + 1) == nullptr);
  void* small = ffmpeg::av_malloc(1 << 20);
  CHECK(small != nullptr);
  ffmpeg::av_free(small);
}

TEST_CASE("ffmpeg: grey is converted without a shift, in both ranges") {
  if (!video_or_skip()) return;
  for (const bool full : {false, true}) {
    const auto yuv = ffmpeg::make_frame(), rgb = ffmpeg::make_frame();
    yuv->format = AV_PIX_FMT_YUV420P, rgb->format = AV_PIX_FMT_RGB24;
    yuv->color_range = full ? AVCOL_RANGE_JPEG : AVCOL_RANGE_MPEG;
    for (AVFrame* frame : {yuv.get(), rgb.get()}) {
      frame->width = 16, frame->height = 8;
      REQUIRE(ffmpeg::av_frame_get_buffer(frame, 0) == 0);
    }
    ffmpeg::Converter converter;
    for (const int luma : {16, 126, 235}) {
      for (int plane = 0; plane < 3; ++plane)
        for (int i = 0; i < yuv->linesize[plane] * (plane == 0 ? 8 : 4); ++i)
          yuv->data[plane][i] = static_cast<std::uint8_t>(plane == 0 ? luma : 128);
      converter.convert(*yuv, *rgb);
      const double grey = full ? luma : (luma - 16) * 255.0 / 219;
      for (int i = 0; i < 3; ++i) CHECK(std::abs(rgb->data[0][3 * 5 + i] - grey) <= 1);
    }
  }
}
#endif
