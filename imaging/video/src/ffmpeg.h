#pragma once
// FFmpeg's objects with owners, and its errors as texts.
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

/// Frame or packet. @throws std::bad_alloc
Owned<AVFrame> make_frame();
Owned<AVPacket> make_packet();

/// Keeps FFmpeg's messages from standard error; see reason(). Forgets those of this thread.
void take_messages();
/// Why a call failed: FFmpeg's first message of this thread since take_messages(), else the text of the
/// error.
std::string reason(int error);

/// Converts between RGB and YUV with BT.709 from 720 lines on and BT.601 below, unless a frame states its
/// matrix, and with the same bits on every CPU.
class Converter {
 public:
  /// Both frames have their format, size and buffers. @throws Error if FFmpeg cannot convert the formats
  void convert(const AVFrame& from, AVFrame& to);

 private:
  Owned<SwsContext> context_;
  int key_[9]{};  ///< sizes, formats, matrix and range that context_ is for
};

/// EXIF's name for the turn of a display matrix of ISO/IEC 14496-12: see exif_orientation().
/// @param matrix  [9], null: none   @return 1 to 8; of other angles the nearest
int orientation_of(const std::int32_t* matrix);

}  // namespace fieldmark::ffmpeg
#endif
