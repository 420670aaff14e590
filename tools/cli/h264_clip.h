#pragma once
#include <fieldmark/imaging/video/video_reader.h>
#include <fieldmark/imaging/video/video_writer.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace fieldmark::cli {

/// Sends images in order through H.264 and back. All images are added first; then they are returned one at a
/// time in their original size.
class H264Clip {
 public:
  /// @param crf  0 to 51   @throws ValueError if it is out of range, or this build cannot encode H.264
  explicit H264Clip(int crf);
  /// @param image  [H, W, 3]   @param name  for error messages
  /// @throws IoError unless it has the size of the first
  /// @throws ValueError if it is smaller than 2 x 2 pixels
  void add(const Tensor<float>& image, const std::string& name);
  /// Returns the next image, multiples of 1/255; nullopt after the last.
  /// @throws IoError if the decoder returns fewer
  std::optional<Tensor<float>> next();

 private:
  int crf_;
  Index width_ = 0, height_ = 0, left_ = 0;
  std::unique_ptr<VideoWriter> writer_;
  std::vector<std::byte> file_;
  std::unique_ptr<VideoReader> reader_;
};

}  // namespace fieldmark::cli
