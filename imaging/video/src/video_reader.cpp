#include "fieldmark/imaging/video/video_reader.h"

#include <fieldmark/core/error.h>
#include <fieldmark/imaging/exif.h>

#include "ffmpeg.h"

#ifdef FIELDMARK_WITH_VIDEO
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <set>
#endif

namespace fieldmark {
namespace {
void need_video(const std::string& name) {
  if (const std::string lack = ffmpeg::lack(); !lack.empty()) throw IoError(name + ": " + lack);
}
}  // namespace

bool has_video() { return ffmpeg::lack().empty(); }

#ifdef FIELDMARK_WITH_VIDEO
namespace {

using namespace ffmpeg;

constexpr std::int64_t kNever = AV_NOPTS_VALUE;
constexpr std::int64_t kMaxFrame = 1 << 25;  // pixels: 8K; limits the allocation that a few bytes can request

struct Close {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, Close>;

int read_bytes_of(void* file, std::uint8_t* to, int size) {
  const std::size_t read = std::fread(to, 1, static_cast<std::size_t>(size), static_cast<std::FILE*>(file));
  return read > 0 ? static_cast<int>(read) : AVERROR_EOF;
}

std::int64_t seek_in(void* context, std::int64_t offset, int whence) {
  auto* file = static_cast<std::FILE*>(context);
  if (whence != AVSEEK_SIZE)
    return ::fseeko(file, offset, whence & ~AVSEEK_FORCE) == 0 ? ::ftello(file) : AVERROR(EIO);
  const off_t here = ::ftello(file);
  if (::fseeko(file, 0, SEEK_END) != 0) return AVERROR(EIO);
  const off_t size = ::ftello(file);
  return ::fseeko(file, here, SEEK_SET) == 0 ? size : AVERROR(EIO);
}

// An open container. FFmpeg reads through our file, so that it opens nothing by name.
class Container {
 public:
  Container(File file, const std::string& name) : file_(std::move(file)) {
    constexpr int kBuffer = 1 << 16;
    auto* buffer = static_cast<unsigned char*>(av_malloc(kBuffer));
    io_ = avio_alloc_context(buffer, kBuffer, 0, file_.get(), read_bytes_of, nullptr, seek_in);
    format_ = avformat_alloc_context();
    if (!io_ || !format_) throw std::bad_alloc();
    format_->pb = io_;
    format_->flags |= AVFMT_FLAG_CUSTOM_IO | AVFMT_FLAG_DISCARD_CORRUPT;
    format_->max_streams = 100;
    AVDictionary* options = nullptr;
    av_dict_set(&options, "format_whitelist", "mov,mp4,m4a,3gp,3g2,mj2,matroska,webm", 0);
    int error = avformat_open_input(&format_, "", nullptr, &options);  // frees format_ on failure
    av_dict_free(&options);
    if (error >= 0) error = avformat_find_stream_info(format_, nullptr);
    if (error >= 0) return;
    const std::string why = ffmpeg::reason(error);
    close();
    throw IoError(name + ": expected an MP4, MOV or WebM video, found a file that cannot be opened as one: " +
                  why + "; copy it again from where it is whole");
  }
  Container(const Container&) = delete;
  Container& operator=(const Container&) = delete;
  ~Container() { close(); }
  AVFormatContext* operator->() const { return format_; }
  AVFormatContext* get() const { return format_; }

 private:
  void close() {
    avformat_close_input(&format_);
    if (io_) av_freep(&io_->buffer);
    avio_context_free(&io_);
  }
  File file_;
  AVIOContext* io_ = nullptr;
  AVFormatContext* format_ = nullptr;
};

File opened(const std::filesystem::path& path) {
  File file(std::fopen(path.c_str(), "rb"));
  if (!file) throw IoError("[read] " + path.string() + ": open failed: " + std::strerror(errno));
  return file;
}

File in_memory(std::span<const std::byte> bytes, const std::string& name) {
  if (bytes.empty()) throw IoError(name + ": expected an MP4, MOV or WebM video, found an empty file");
  // In read mode, fmemopen() does not modify the bytes.
  File file(::fmemopen(const_cast<std::byte*>(bytes.data()), bytes.size(), "rb"));
  if (!file) throw IoError(name + ": open failed: " + std::strerror(errno));
  return file;
}

AVStream* video_stream(const Container& container, const std::string& name) {
  std::set<std::string> kinds;
  for (unsigned i = 0; i < container->nb_streams; ++i) {
    AVStream* stream = container->streams[i];
    const bool cover = (stream->disposition & AV_DISPOSITION_ATTACHED_PIC) != 0;
    if (stream->codecpar->codec_type == AVMEDIA_TYPE_VIDEO && !cover) return stream;
    const char* kind = av_get_media_type_string(stream->codecpar->codec_type);
    kinds.insert(cover ? "cover image" : kind ? kind : "unknown");
  }
  std::string found;
  for (const std::string& kind : kinds) found += (found.empty() ? "" : ", ") + kind;
  throw IoError(
      name + ": expected a video, found a file without: " + (found.empty() ? "no stream" : "only " + found));
}

const std::int32_t* display_matrix(const AVStream& stream) {
  constexpr std::size_t kSize = 9 * sizeof(std::int32_t);
#if LIBAVFORMAT_VERSION_INT >= AV_VERSION_INT(60, 15, 100)
  const AVPacketSideData* side = av_packet_side_data_get(
      stream.codecpar->coded_side_data, stream.codecpar->nb_coded_side_data, AV_PKT_DATA_DISPLAYMATRIX);
  const void* data = side && side->size >= kSize ? side->data : nullptr;
#else
  std::size_t size = 0;
  const void* data = av_stream_get_side_data(&stream, AV_PKT_DATA_DISPLAYMATRIX, &size);
  if (size < kSize) data = nullptr;
#endif
  return static_cast<const std::int32_t*>(data);
}

// Returns the size with square pixels; one side grows.
std::pair<int, int> square_size(const AVFrame& frame, AVRational pixel) {
  constexpr double kMost = 4;
  const double ratio = pixel.num > 0 && pixel.den > 0 ? av_q2d(pixel) : 1;
  if (ratio > kMost || ratio < 1 / kMost) return {frame.width, frame.height};
  const auto grown = [](int side, double by) {
    return static_cast<int>(std::lround(side * std::max(1.0, by)));
  };
  return {grown(frame.width, ratio), grown(frame.height, 1 / ratio)};
}

}  // namespace

struct VideoReader::Impl {
  Impl(File file, std::string file_name)
      : name(std::move(file_name)),
        container((ffmpeg::limit_memory(), ffmpeg::take_messages(), std::move(file)), name),
        stream(video_stream(container, name)),
        orientation(ffmpeg::orientation_of(display_matrix(*stream))) {
    for (unsigned i = 0; i < container->nb_streams; ++i)
      if (container->streams[i] != stream) container->streams[i]->discard = AVDISCARD_ALL;
    open_codec();
    scan();
    seek(times.front());
  }

  [[noreturn]] void fail(const std::string& what) const { throw IoError(name + ": " + what); }

  void open_codec() {
    const AVCodecParameters& coded = *stream->codecpar;
    const AVCodec* decoder = avcodec_find_decoder(coded.codec_id);
    if (!decoder)
      fail(std::string("expected a video that FFmpeg decodes, found codec ") +
           avcodec_get_name(coded.codec_id));
    codec.reset(avcodec_alloc_context3(decoder));
    if (!codec) throw std::bad_alloc();
    codec->thread_count = 1;
    codec->max_pixels = kMaxFrame;
    codec->pkt_timebase = stream->time_base;
    int error = avcodec_parameters_to_context(codec.get(), &coded);
    if (error >= 0) error = avcodec_open2(codec.get(), decoder, nullptr);
    if (error < 0)
      fail(std::string("the decoder of ") + decoder->name + " refuses the video: " + ffmpeg::reason(error));
  }

  // Collects the times of all frames from the packets.
  void scan() {
    std::int64_t latest = 0, last = 0;  // latest time and its duration
    while (av_read_frame(container.get(), packet.get()) >= 0) {
      const bool shown = packet->stream_index == stream->index && !(packet->flags & AV_PKT_FLAG_DISCARD);
      const std::int64_t time = packet->pts != kNever ? packet->pts : packet->dts;
      if (shown && time != kNever && std::abs(time) < std::int64_t{1} << 60) {
        if (times.empty() || time >= latest) latest = time, last = packet->duration;
        times.push_back(time);
        if (packet->flags & AV_PKT_FLAG_KEY) keys.push_back(time);
      }
      av_packet_unref(packet.get());
    }
    if (times.empty())
      fail("expected a video with frames, found none: it is empty, or truncated before the first");
    std::ranges::sort(times);
    times.erase(std::unique(times.begin(), times.end()), times.end());
    std::ranges::sort(keys);
    const std::int64_t span = times.back() - times.front(), count = std::ssize(times);
    end = times.back() + (last > 0 && last < std::int64_t{1} << 60 ? last
                          : count > 1                              ? span / (count - 1)
                                                                   : 1);
  }

  double seconds_of(std::int64_t time) const {
    return static_cast<double>(time - times.front()) * av_q2d(stream->time_base);
  }
  // Returns the time of the frame shown; adding half a unit compensates for rounding.
  std::int64_t time_at(double seconds) const {
    const double units = seconds / av_q2d(stream->time_base) + 0.5;
    const double most = static_cast<double>(end - times.front());
    const auto wanted = times.front() + static_cast<std::int64_t>(std::floor(std::clamp(units, 0.0, most)));
    const auto after = std::ranges::upper_bound(times, wanted);
    return after == times.begin() ? times.front() : *(after - 1);
  }

  void seek(std::int64_t time) {
    if (av_seek_frame(container.get(), stream->index, time, AVSEEK_FLAG_BACKWARD) < 0 &&
        av_seek_frame(container.get(), -1, 0, AVSEEK_FLAG_BYTE) < 0)
      av_seek_frame(container.get(), stream->index, times.front(), AVSEEK_FLAG_ANY);
    avcodec_flush_buffers(codec.get());
    position = kNever;
    ended = faulty = false;
  }

  // Decodes the next frame into `frame`.
  bool decode() {
    for (;;) {
      const int received = avcodec_receive_frame(codec.get(), frame.get());
      if (received == 0) {
        // After a frame without a time, only the order is known.
        const std::int64_t time = frame->best_effort_timestamp;
        position = time != kNever ? time : position == kNever ? times.front() : position + 1;
        return true;
      }
      if (received == AVERROR_EOF || ended) return false;
      faulty = faulty || received != AVERROR(EAGAIN);
      if (av_read_frame(container.get(), packet.get()) < 0) {
        ended = true;
        avcodec_send_packet(codec.get(), nullptr);
        continue;
      }
      if (packet->stream_index == stream->index)
        faulty = avcodec_send_packet(codec.get(), packet.get()) < 0 || faulty;
      av_packet_unref(packet.get());
    }
  }

  // Decodes up to the frame at `time`, starting where a seek went. Returns false if the seek overshot.
  bool decode_to(std::int64_t time) {
    bool any = false;
    while (decode()) {
      // The seek overshot: the caller then decodes from the beginning.
      if (!any && position > time && time > times.front() && !from_start) return false;
      any = true;
      if (position >= time) return true;
      av_frame_unref(before.get());
      av_frame_ref(before.get(), frame.get());
    }
    if (!before->buf[0]) return false;
    av_frame_unref(frame.get());
    av_frame_move_ref(frame.get(), before.get());
    return true;
  }

  bool key_between(std::int64_t first, std::int64_t last) const {
    const auto key = std::ranges::upper_bound(keys, last);
    return key != keys.begin() && *(key - 1) > first;
  }

  void read(std::int64_t time) {
    ffmpeg::take_messages();
    from_start = false;
    if (position == kNever || ended || position >= time || key_between(position, time)) seek(time);
    av_frame_unref(before.get());
    if (decode_to(time)) return;
    seek(times.front());
    from_start = true;
    av_frame_unref(before.get());
    if (!decode_to(time)) fail("no frame can be decoded: " + ffmpeg::reason(AVERROR_INVALIDDATA));
  }

  VideoFrame shown() {
    const auto [width, height] =
        square_size(*frame, av_guess_sample_aspect_ratio(container.get(), stream, frame.get()));
    const Owned<AVFrame> rgb = ffmpeg::make_frame();
    rgb->format = AV_PIX_FMT_RGB24;
    rgb->width = width, rgb->height = height;
    if (width < 1 || height < 1 || std::int64_t{width} * height > kMaxFrame ||
        av_frame_get_buffer(rgb.get(), 0) < 0)
      fail("a frame of " + std::to_string(width) + " x " + std::to_string(height) + " pixels; at most " +
           std::to_string(kMaxFrame) + " are read");
    converter.convert(*frame, *rgb);
    Tensor<float> image({height, width, 3});
    for (Index y = 0; y < height; ++y)
      std::transform(rgb->data[0] + y * rgb->linesize[0], rgb->data[0] + y * rgb->linesize[0] + 3 * width,
                     image.data.begin() + 3 * width * y,
                     [](std::uint8_t byte) { return static_cast<float>(byte) / 255.0f; });
    const bool damaged =
        faulty || frame->decode_error_flags != 0 || (frame->flags & AV_FRAME_FLAG_CORRUPT) != 0;
    return {.image = orientation == 1 ? std::move(image) : turned(image, orientation),
            .time = std::max(0.0, seconds_of(position)),
            .damaged = damaged};
  }

  std::string name;
  Container container;
  AVStream* stream;
  int orientation;
  Owned<AVCodecContext> codec;
  Owned<AVPacket> packet = ffmpeg::make_packet();
  Owned<AVFrame> frame = ffmpeg::make_frame(), before = ffmpeg::make_frame();
  ffmpeg::Converter converter;
  std::vector<std::int64_t> times, keys;  // of all frames and of keyframes, sorted
  std::int64_t end = 0;                   // of the last frame
  std::int64_t position = kNever;         // time of the last decoded frame
  bool ended = false, faulty = false, from_start = false;
};

VideoReader::VideoReader(const std::filesystem::path& path)
    : impl_((need_video(path.string()), std::make_unique<Impl>(opened(path), path.string()))) {}
VideoReader::VideoReader(std::span<const std::byte> bytes, const std::string& name)
    : impl_((need_video(name), std::make_unique<Impl>(in_memory(bytes, name), name))) {}
VideoReader::~VideoReader() = default;

double VideoReader::seconds() const { return impl_->seconds_of(impl_->end); }

std::vector<double> VideoReader::sample_times(Index count) const {
  if (count < 1) throw ValueError("[video] count must be at least 1, got " + std::to_string(count));
  std::vector<double> times;
  for (Index k = 0; k < count; ++k) {
    const double middle = (static_cast<double>(k) + 0.5) * seconds() / static_cast<double>(count);
    const double time = impl_->seconds_of(impl_->time_at(middle));
    if (times.empty() || time > times.back()) times.push_back(time);
  }
  return times;
}

VideoFrame VideoReader::read_at(double seconds) {
  impl_->read(impl_->time_at(seconds));
  return impl_->shown();
}

std::optional<VideoFrame> VideoReader::next() {
  ffmpeg::take_messages();
  if (!impl_->decode()) return std::nullopt;
  return impl_->shown();
}

std::string VideoReader::oddity() const {
  constexpr double kTolerance = 1;  // seconds: headers are rounded
  const AVStream& stream = *impl_->stream;
  if (stream.duration <= 0) return "";
  const double stated = static_cast<double>(stream.duration) * av_q2d(stream.time_base);
  if (!(stated > seconds() + kTolerance)) return "";
  char text[120];
  std::snprintf(text, sizeof text, "the video is truncated: %.1f of %.1f seconds are there", seconds(),
                stated);
  return text;
}

#else

struct VideoReader::Impl {};
VideoReader::VideoReader(const std::filesystem::path& path) { need_video(path.string()); }
VideoReader::VideoReader(std::span<const std::byte>, const std::string& name) { need_video(name); }
VideoReader::~VideoReader() = default;
double VideoReader::seconds() const { return 0; }
std::vector<double> VideoReader::sample_times(Index) const { return {}; }
VideoFrame VideoReader::read_at(double) { return {}; }
std::optional<VideoFrame> VideoReader::next() { return std::nullopt; }
std::string VideoReader::oddity() const { return ""; }

#endif

}  // namespace fieldmark
