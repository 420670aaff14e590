#pragma once
// FFmpeg's functions under their own names, each resolved on its first call. Its libraries pull in a hundred
// others; loading them all takes longer than most commands, which use no video.
#ifdef FIELDMARK_WITH_VIDEO
extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/opt.h>
#include <libswscale/swscale.h>
}

#include <atomic>
#endif
#include <string>

namespace fieldmark::ffmpeg {

/// Returns why video is not supported: this build lacks it, or a library cannot be loaded. Empty if it is.
std::string lack();

#ifdef FIELDMARK_WITH_VIDEO
enum class Library { util, codec, format, scale };

/// Returns the address of a function in a library of the version that Fieldmark was built with.
/// @throws Error if the library is not installed
void* address(Library library, const char* function);

template <class Signature>
class Function;

/// Calls a function of FFmpeg. @throws Error if its library is not installed
template <class Result, class... Arguments>
class Function<Result(Arguments...)> {
 public:
  constexpr Function(Library library, const char* name) : library_(library), name_(name) {}
  Result operator()(Arguments... arguments) const {
    void* found = address_.load(std::memory_order_relaxed);
    if (!found) address_.store(found = address(library_, name_), std::memory_order_relaxed);
    return reinterpret_cast<Result (*)(Arguments...)>(found)(arguments...);
  }

 private:
  Library library_;
  const char* name_;
  mutable std::atomic<void*> address_{nullptr};
};

// Yields the type of a function without its attributes, which templates do not accept. Never called.
template <class Result, class... Arguments>
Function<Result(Arguments...)> like(Result (*)(Arguments...));

#define FIELDMARK_FFMPEG(library, name) \
  inline constinit const decltype(like(&::name)) name { Library::library, #name }
FIELDMARK_FFMPEG(util, av_dict_free);
FIELDMARK_FFMPEG(util, av_dict_set);
FIELDMARK_FFMPEG(util, av_frame_alloc);
FIELDMARK_FFMPEG(util, av_frame_free);
FIELDMARK_FFMPEG(util, av_frame_get_buffer);
FIELDMARK_FFMPEG(util, av_frame_make_writable);
FIELDMARK_FFMPEG(util, av_frame_move_ref);
FIELDMARK_FFMPEG(util, av_frame_ref);
FIELDMARK_FFMPEG(util, av_frame_unref);
FIELDMARK_FFMPEG(util, av_free);
FIELDMARK_FFMPEG(util, av_freep);
FIELDMARK_FFMPEG(util, av_get_media_type_string);
FIELDMARK_FFMPEG(util, av_log_format_line2);
FIELDMARK_FFMPEG(util, av_log_set_callback);
FIELDMARK_FFMPEG(util, av_malloc);
FIELDMARK_FFMPEG(util, av_max_alloc);
FIELDMARK_FFMPEG(util, av_opt_set_int);
FIELDMARK_FFMPEG(util, av_strerror);
FIELDMARK_FFMPEG(codec, av_packet_alloc);
FIELDMARK_FFMPEG(codec, av_packet_free);
FIELDMARK_FFMPEG(codec, av_packet_rescale_ts);
FIELDMARK_FFMPEG(codec, av_packet_unref);
FIELDMARK_FFMPEG(codec, avcodec_alloc_context3);
FIELDMARK_FFMPEG(codec, avcodec_find_decoder);
FIELDMARK_FFMPEG(codec, avcodec_find_encoder_by_name);
FIELDMARK_FFMPEG(codec, avcodec_flush_buffers);
FIELDMARK_FFMPEG(codec, avcodec_free_context);
FIELDMARK_FFMPEG(codec, avcodec_get_name);
FIELDMARK_FFMPEG(codec, avcodec_open2);
FIELDMARK_FFMPEG(codec, avcodec_parameters_from_context);
FIELDMARK_FFMPEG(codec, avcodec_parameters_to_context);
FIELDMARK_FFMPEG(codec, avcodec_receive_frame);
FIELDMARK_FFMPEG(codec, avcodec_receive_packet);
FIELDMARK_FFMPEG(codec, avcodec_send_frame);
FIELDMARK_FFMPEG(codec, avcodec_send_packet);
FIELDMARK_FFMPEG(format, av_guess_sample_aspect_ratio);
FIELDMARK_FFMPEG(format, av_interleaved_write_frame);
FIELDMARK_FFMPEG(format, av_read_frame);
FIELDMARK_FFMPEG(format, av_seek_frame);
FIELDMARK_FFMPEG(format, av_write_trailer);
FIELDMARK_FFMPEG(format, avformat_alloc_context);
FIELDMARK_FFMPEG(format, avformat_alloc_output_context2);
FIELDMARK_FFMPEG(format, avformat_close_input);
FIELDMARK_FFMPEG(format, avformat_find_stream_info);
FIELDMARK_FFMPEG(format, avformat_free_context);
FIELDMARK_FFMPEG(format, avformat_new_stream);
FIELDMARK_FFMPEG(format, avformat_open_input);
FIELDMARK_FFMPEG(format, avformat_write_header);
FIELDMARK_FFMPEG(format, avio_alloc_context);
FIELDMARK_FFMPEG(format, avio_close_dyn_buf);
FIELDMARK_FFMPEG(format, avio_context_free);
FIELDMARK_FFMPEG(format, avio_open_dyn_buf);
FIELDMARK_FFMPEG(scale, sws_freeContext);
FIELDMARK_FFMPEG(scale, sws_getCoefficients);
FIELDMARK_FFMPEG(scale, sws_getContext);
FIELDMARK_FFMPEG(scale, sws_scale);
FIELDMARK_FFMPEG(scale, sws_setColorspaceDetails);
#if LIBAVFORMAT_VERSION_INT >= AV_VERSION_INT(60, 15, 100)
FIELDMARK_FFMPEG(codec, av_packet_side_data_get);
#else
FIELDMARK_FFMPEG(format, av_stream_get_side_data);
#endif
#undef FIELDMARK_FFMPEG
#endif

}  // namespace fieldmark::ffmpeg
