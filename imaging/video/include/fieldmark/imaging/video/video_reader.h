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

/// True if videos can be read and written: Fieldmark was built with libavformat, libavcodec and libswscale,
/// and they can be loaded. The first call loads them.
bool has_video();

/// A frame of a video.
struct VideoFrame {
  Tensor<float> image;   ///< [height, width, 3] as shown: upright, square pixels, multiples of 1/255
  double time = 0;       ///< display time in seconds from the first frame
  bool damaged = false;  ///< the decoder filled in data that the file lacks
};

/// Reads an MP4, MOV or WebM file frame by frame. It uses one thread, so the bits do not depend on the
/// machine. Frame times come from all packets of the file instead of its headers, so that files that are
/// truncated, state no duration or change their frame rate are sampled evenly too. No other file and no
/// network is ever opened. FFmpeg's messages, process-wide, go to error messages instead of standard error.
/// YUV without a stated matrix is BT.709 from 720 lines on, else BT.601. HDR is not tone-mapped.
class VideoReader {
 public:
  /// @throws IoError if the file is missing, damaged beyond reading, of another format or without a video, or
  /// has_video() is false
  explicit VideoReader(const std::filesystem::path& path);
  /// Reads a file in memory. @param bytes  must outlive this   @param name  stands for the path in error
  /// messages
  VideoReader(std::span<const std::byte> bytes, const std::string& name);
  VideoReader(const VideoReader&) = delete;
  VideoReader& operator=(const VideoReader&) = delete;
  ~VideoReader();

  /// Returns the time from the first frame to the end of the last, in seconds.
  double seconds() const;
  /// Returns the times of the frames shown at (k + 1/2) seconds() / count for k = 0 ... count - 1, increasing
  /// and without duplicates; at least one. @param count  at least 1
  std::vector<double> sample_times(Index count) const;
  /// Returns the frame shown at a time. In damaged files: the next that can be decoded, else the last before.
  /// @param seconds  from the first frame; clamped to the first and last   @throws IoError if there is none
  VideoFrame read_at(double seconds);
  /// Returns the frame after the last one read, initially the first; nullopt at the end.
  std::optional<VideoFrame> next();
  /// Returns text for a warning if the file lacks frames that its header states; empty if nothing is odd.
  std::string oddity() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fieldmark
