#pragma once
#include <fieldmark/engine/tensor.h>

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace fieldmark {

/// Whether videos can be read and written: Fieldmark was built with libavformat, libavcodec and libswscale,
/// and they can be loaded. The first call loads them.
bool has_video();

/// One frame of a video.
struct VideoFrame {
  Tensor<float> image;   ///< [height, width, 3] as shown: upright, square pixels, multiples of 1/255
  double time = 0;       ///< when it is shown, seconds from the first frame
  bool damaged = false;  ///< the decoder made up what the file lacks
};

/// Reads an MP4, MOV or WebM file, one frame at a time and with one thread: the bits do not depend on the
/// machine. The times of frames come from all packets of the file, not from its headers, so files that are
/// truncated, state no duration or change their frame rate are sampled evenly too. No other file and no
/// network is ever opened. FFmpeg's messages, of the whole process, go to the texts of errors in place of
/// standard error. YUV without a stated matrix is BT.709 from 720 lines on, else BT.601. The colours of HDR
/// are not mapped.
class VideoReader {
 public:
  /// @throws IoError if the file is missing, damaged beyond reading, of another format or without a video,
  /// and where has_video() is false
  explicit VideoReader(const std::filesystem::path& path);
  /// A file in memory. @param bytes  must outlive this   @param name  stands for the path in error texts
  VideoReader(std::span<const std::byte> bytes, const std::string& name);
  VideoReader(const VideoReader&) = delete;
  VideoReader& operator=(const VideoReader&) = delete;
  ~VideoReader();

  /// From the first frame to the end of the last, seconds.
  double seconds() const;
  /// Times of frames, at least one, increasing: of the frames that are shown at (k + 1/2) seconds() / count
  /// for k = 0 ... count - 1, each once. @param count  at least 1
  std::vector<double> sample_times(Index count) const;
  /// The frame shown at a time; of a damaged file the next that can be decoded, else the last before.
  /// @param seconds  from the first frame; beyond the ends the first or last   @throws IoError if there is
  /// none
  VideoFrame read_at(double seconds);
  /// The frame behind the last that was read, at first the first; none at the end.
  std::optional<VideoFrame> next();
  /// A text for a warning where the file lacks frames that its header states; empty where nothing is odd.
  std::string oddity() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fieldmark
