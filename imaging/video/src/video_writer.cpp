#include "fieldmark/imaging/video/video_writer.h"

#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/imaging/image.h>

#include <algorithm>
#include <cmath>

#include "ffmpeg.h"

namespace fieldmark {

#ifdef FIELDMARK_WITH_VIDEO
namespace {

using namespace ffmpeg;

void need(int result) {
  if (result < 0) throw Error("[video_writer] FFmpeg: " + ffmpeg::reason(result));
}

int even(Index side) { return static_cast<int>(side + side % 2); }

}  // namespace

struct VideoWriter::Impl {
  Impl(Index image_width, Index image_height, const VideoOptions& options)
      : width(image_width), height(image_height) {
    ffmpeg::take_messages();
    open_codec(options);
    open_file();
    rgb->format = AV_PIX_FMT_RGB24;
    yuv->format = codec->pix_fmt;
    for (AVFrame* frame : {rgb.get(), yuv.get()}) {
      frame->width = codec->width, frame->height = codec->height;
      need(av_frame_get_buffer(frame, 0));
    }
    yuv->color_range = codec->color_range;
    yuv->colorspace = codec->colorspace;
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (file && file->pb) close_buffer();
    avformat_free_context(file);
  }

  void open_codec(const VideoOptions& options) {
    const AVCodec* encoder = avcodec_find_encoder_by_name("libx264");
    if (!encoder) throw ValueError("[video_writer] H.264 needs an FFmpeg with libx264, which this one lacks");
    codec.reset(avcodec_alloc_context3(encoder));
    if (!codec) throw std::bad_alloc();
    constexpr int kHighDefinition = 720, kMilli = 1000;
    codec->width = even(width), codec->height = even(height);
    codec->pix_fmt = AV_PIX_FMT_YUV420P;
    codec->time_base = {kMilli, static_cast<int>(std::lround(kMilli * options.frames_per_second))};
    codec->framerate = av_inv_q(codec->time_base);
    codec->color_range = AVCOL_RANGE_MPEG;
    codec->colorspace = codec->height >= kHighDefinition ? AVCOL_SPC_BT709 : AVCOL_SPC_SMPTE170M;
    codec->color_primaries = AVCOL_PRI_BT709;
    codec->color_trc = AVCOL_TRC_IEC61966_2_1;
    codec->thread_count = 1;
    codec->flags |= AV_CODEC_FLAG_GLOBAL_HEADER | AV_CODEC_FLAG_BITEXACT;
    need(av_opt_set_int(codec->priv_data, "crf", options.crf, 0));
    need(avcodec_open2(codec.get(), encoder, nullptr));
  }

  void open_file() {
    need(avformat_alloc_output_context2(&file, nullptr, "mp4", nullptr));
    file->flags |= AVFMT_FLAG_BITEXACT;
    stream = avformat_new_stream(file, nullptr);
    if (!stream) throw std::bad_alloc();
    stream->time_base = codec->time_base;
    stream->avg_frame_rate = codec->framerate;
    need(avcodec_parameters_from_context(stream->codecpar, codec.get()));
    need(avio_open_dyn_buf(&file->pb));
    need(avformat_write_header(file, nullptr));
  }

  // @param frame  null: flushes the last frames
  void encode(const AVFrame* frame) {
    need(avcodec_send_frame(codec.get(), frame));
    for (;;) {
      const int received = avcodec_receive_packet(codec.get(), packet.get());
      if (received == AVERROR(EAGAIN) || received == AVERROR_EOF) return;
      need(received);
      packet->duration = 1;
      av_packet_rescale_ts(packet.get(), codec->time_base, stream->time_base);
      packet->stream_index = stream->index;
      need(av_interleaved_write_frame(file, packet.get()));
    }
  }

  std::vector<std::byte> close_buffer() {
    std::uint8_t* bytes = nullptr;
    const int size = avio_close_dyn_buf(file->pb, &bytes);
    file->pb = nullptr;
    const auto* first = reinterpret_cast<const std::byte*>(bytes);
    std::vector<std::byte> whole(first, first + size);
    av_free(bytes);
    return whole;
  }

  Index width, height;
  Owned<AVCodecContext> codec;
  AVFormatContext* file = nullptr;
  AVStream* stream = nullptr;
  Owned<AVFrame> rgb = ffmpeg::make_frame(), yuv = ffmpeg::make_frame();
  Owned<AVPacket> packet = ffmpeg::make_packet();
  ffmpeg::Converter converter;
  std::int64_t frames = 0;
};

VideoWriter::VideoWriter(Index width, Index height, const VideoOptions& options) {
  if (const std::string lack = ffmpeg::lack(); !lack.empty()) throw ValueError("[video_writer] " + lack);
  constexpr Index kMaxSide = 8192;
  if (width < 2 || height < 2 || width > kMaxSide || height > kMaxSide)
    throw ValueError("[video_writer] width and height must be from 2 to " + std::to_string(kMaxSide) +
                     ", got " + std::to_string(width) + " x " + std::to_string(height));
  if (options.crf < 0 || options.crf > 51)
    throw ValueError("[video_writer] crf must be from 0 to 51, got " + std::to_string(options.crf));
  if (!(options.frames_per_second >= 0.001 && options.frames_per_second <= 1000))
    throw ValueError("[video_writer] frames_per_second must be from 0.001 to 1000, got " +
                     number_text(options.frames_per_second));
  impl_ = std::make_unique<Impl>(width, height, options);
}
VideoWriter::~VideoWriter() = default;

void VideoWriter::add(const Tensor<float>& image) {
  Impl& to = *impl_;
  if (image.shape != Shape{to.height, to.width, 3})
    throw ShapeError("[video_writer] image: all frames must be of shape " +
                     Shape{to.height, to.width, 3}.str() + ", got shape " + image.shape.str());
  ffmpeg::take_messages();
  const auto bytes = bytes_of(image);
  const std::size_t line = 3 * static_cast<std::size_t>(to.width);
  need(av_frame_make_writable(to.rgb.get()));
  need(av_frame_make_writable(to.yuv.get()));
  for (Index y = 0; y < to.rgb->height; ++y) {
    std::uint8_t* row = to.rgb->data[0] + y * to.rgb->linesize[0];
    std::copy_n(bytes.data() + static_cast<std::size_t>(std::min(y, to.height - 1)) * line, line, row);
    if (to.rgb->width > to.width) std::copy_n(row + line - 3, 3, row + line);
  }
  to.converter.convert(*to.rgb, *to.yuv);
  to.yuv->pts = to.frames++;
  to.encode(to.yuv.get());
}

std::vector<std::byte> VideoWriter::finish() {
  if (impl_->frames == 0) throw ValueError("[video_writer] a video needs at least one frame");
  ffmpeg::take_messages();
  impl_->encode(nullptr);
  need(av_write_trailer(impl_->file));
  return impl_->close_buffer();
}

#else

struct VideoWriter::Impl {};
VideoWriter::VideoWriter(Index, Index, const VideoOptions&) {
  throw ValueError("[video_writer] " + ffmpeg::lack());
}
VideoWriter::~VideoWriter() = default;
void VideoWriter::add(const Tensor<float>&) {}
std::vector<std::byte> VideoWriter::finish() { return {}; }

#endif

}  // namespace fieldmark
