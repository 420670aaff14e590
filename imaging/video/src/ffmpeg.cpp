#include "ffmpeg.h"

#ifdef FIELDMARK_WITH_VIDEO
#include <fieldmark/core/error.h>

#include <algorithm>
#include <cstdarg>
#include <cstdlib>
#include <new>

namespace fieldmark::ffmpeg {
namespace {

thread_local std::string first_message;

void keep_message(void* from, int level, const char* format, va_list values) {
  if (level > AV_LOG_ERROR || !first_message.empty()) return;
  char line[300];
  int prefix = 0;
  av_log_format_line2(from, level, format, values, line, sizeof line, &prefix);
  first_message = line;
  // Drops a prefix such as "[mov,mp4,m4a,3gp,3g2,mj2 @ 0x55d0]".
  if (const auto end = first_message.find("] "); first_message.starts_with('[') && end != std::string::npos)
    first_message.erase(0, end + 2);
  while (!first_message.empty() && (first_message.back() == '\n' || first_message.back() == '.'))
    first_message.pop_back();
}

int matrix_of(const AVFrame& frame) {
  switch (frame.colorspace) {
    case AVCOL_SPC_BT709:
      return SWS_CS_ITU709;
    case AVCOL_SPC_FCC:
      return SWS_CS_FCC;
    case AVCOL_SPC_BT470BG:
    case AVCOL_SPC_SMPTE170M:
      return SWS_CS_ITU601;
    case AVCOL_SPC_SMPTE240M:
      return SWS_CS_SMPTE240M;
    case AVCOL_SPC_BT2020_NCL:
    case AVCOL_SPC_BT2020_CL:
      return SWS_CS_BT2020;
    default: {
      constexpr int kHighDefinition = 720;
      return frame.height >= kHighDefinition ? SWS_CS_ITU709 : SWS_CS_ITU601;
    }
  }
}

bool is_full_range(const AVFrame& frame) {
  switch (frame.format) {
    case AV_PIX_FMT_RGB24:
    case AV_PIX_FMT_YUVJ420P:
    case AV_PIX_FMT_YUVJ422P:
    case AV_PIX_FMT_YUVJ444P:
    case AV_PIX_FMT_YUVJ440P:
      return true;
    default:
      return frame.color_range == AVCOL_RANGE_JPEG;
  }
}

}  // namespace

Owned<AVFrame> make_frame() {
  Owned<AVFrame> frame(av_frame_alloc());
  if (!frame) throw std::bad_alloc();
  return frame;
}

Owned<AVPacket> make_packet() {
  Owned<AVPacket> packet(av_packet_alloc());
  if (!packet) throw std::bad_alloc();
  return packet;
}

void take_messages() {
  first_message.clear();
  av_log_set_callback(keep_message);
}

void limit_memory() { av_max_alloc(std::size_t{1} << 30); }

std::string reason(int error) {
  if (!first_message.empty()) return first_message;
  char text[AV_ERROR_MAX_STRING_SIZE];
  return av_strerror(error, text, sizeof text) == 0 ? text : "error " + std::to_string(error);
}

void Converter::convert(const AVFrame& from, AVFrame& to) {
  // The YUV side determines the matrix.
  const AVFrame& yuv = from.format == AV_PIX_FMT_RGB24 ? to : from;
  const int matrix = matrix_of(yuv), from_full = is_full_range(from), to_full = is_full_range(to);
  const int key[] = {from.width, from.height, from.format, to.width, to.height,
                     to.format,  matrix,      from_full,   to_full};
  if (!context_ || !std::ranges::equal(key, key_)) {
    constexpr int kFlags =
        SWS_BICUBIC | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT | SWS_FULL_CHR_H_INP | SWS_BITEXACT;
    context_.reset(sws_getContext(from.width, from.height, static_cast<AVPixelFormat>(from.format), to.width,
                                  to.height, static_cast<AVPixelFormat>(to.format), kFlags, nullptr, nullptr,
                                  nullptr));
    if (!context_) throw Error("[video] libswscale cannot convert this pixel format");
    const int* table = sws_getCoefficients(matrix);
    sws_setColorspaceDetails(context_.get(), table, from_full, table, to_full, 0, 1 << 16, 1 << 16);
    std::ranges::copy(key, key_);
  }
  sws_scale(context_.get(), from.data, from.linesize, 0, from.height, to.data, to.linesize);
}

// The matrix maps (x, y) of the stored frame to (a x + c y, b x + d y) of the shown one.
int orientation_of(const std::int32_t* matrix) {
  if (!matrix) return 1;
  const std::int64_t a = matrix[0], b = matrix[1], c = matrix[3], d = matrix[4];
  if (std::abs(a) + std::abs(d) >= std::abs(b) + std::abs(c))
    return a >= 0 ? (d >= 0 ? 1 : 4) : (d >= 0 ? 2 : 3);
  return b >= 0 ? (c >= 0 ? 5 : 6) : (c >= 0 ? 8 : 7);
}

}  // namespace fieldmark::ffmpeg
#endif
