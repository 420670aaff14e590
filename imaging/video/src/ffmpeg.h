#pragma once
// RAII owners of FFmpeg's objects, and its errors as text.
#include "ffmpeg_functions.h"

#ifdef FIELDMARK_WITH_VIDEO
#include <cstdint>
#include <memory>
#include <string>

namespace fieldmark::ffmpeg {

struct Free {
  void operator()(AVPacket* p) const { av_packet_free(&p); }
  void operator()(AVFrame* p) const { av_frame_free(&p); }
  void operator()(AVCodecContext* p) const { avcodec_free_context(&p); }
  void operator()(SwsContext* p) const { sws_freeContext(p); }
};
template <class T>
using Owned = std::unique_ptr<T, Free>;

/// Allocates a frame or packet. @throws std::bad_alloc
Owned<AVFrame> make_frame();
Owned<AVPacket> make_packet();

/// Sets, for the whole process, the largest block that FFmpeg allocates to 1 GiB: a count in a damaged file
/// may ask for any size.
void limit_memory();
/// Captures FFmpeg's messages for reason() instead of standard error. Clears those of this thread.
void take_messages();
/// Returns why a call failed: FFmpeg's first message on this thread since take_messages(), else the text of
/// the error code.
std::string reason(int error);

/// Converts between RGB and YUV, with the same bits on every CPU. Uses BT.709 from 720 lines on and BT.601
/// below, unless a frame states its matrix.
class Converter {
 public:
  /// Both frames must have format, size and buffers. @throws Error if FFmpeg cannot convert the formats
  void convert(const AVFrame& from, AVFrame& to);

 private:
  Owned<SwsContext> context_;
  int key_[9]{};  ///< sizes, formats, matrix and range of context_
};

/// Returns the EXIF orientation of a display matrix of ISO/IEC 14496-12, see exif_orientation().
/// @param matrix  [9], null: none   @return 1 to 8; for other angles the nearest
int orientation_of(const std::int32_t* matrix);

}  // namespace fieldmark::ffmpeg
#endif
