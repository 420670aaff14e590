#pragma once
#include <fieldmark/engine/tensor.h>

#include <cstddef>
#include <memory>
#include <vector>

namespace fieldmark {

/// Settings of VideoWriter.
struct VideoOptions {
  int crf = 18;                   ///< constant rate factor of x264, 0 (lossless) to 51 (worst)
  double frames_per_second = 24;  ///< above 0, at most 1000
};

/// Encodes images as H.264 with 4:2:0 chroma in an MP4 file. Uses x264 with its default preset and one
/// thread, so that equal images give equal bytes. Odd sides are padded to even ones by repeating the last row
/// or column. The colour matrix is BT.709 from 720 lines on, else BT.601.
class VideoWriter {
 public:
  /// @param width, height  of the images, pixels, 2 to 8192   @throws ValueError if a number is out of range,
  /// or this build has no H.264 encoder
  VideoWriter(Index width, Index height, const VideoOptions& options = {});
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;
  ~VideoWriter();
  /// Appends a frame. @param image  [height, width, 3], rounded to 8 bits   @throws ShapeError
  void add(const Tensor<float>& image);
  /// Returns the file; must be the last call. @throws ValueError if there is no frame
  std::vector<std::byte> finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fieldmark
