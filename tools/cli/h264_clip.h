#pragma once
#include <fieldmark/imaging/video/video_reader.h>
#include <fieldmark/imaging/video/video_writer.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace fieldmark::cli {

/// Images in order through H.264 and back: all go in, then all come out, one at a time and in their size.
class H264Clip {
 public:
  /// @param crf  0 to 51   @throws ValueError if it is out of range, or this build cannot encode H.264
  explicit H264Clip(int crf);
  /// @param image  [H, W, 3]   @param name  for errors
  /// @throws IoError unless it has the size of the first   @throws ValueError if it is smaller than 2 x 2
  /// pixels
  void add(const Tensor<float>& image, const std::string& name);
  /// The next image, multiples of 1/255; none after as many as went in.
  /// @throws IoError if the decoder gives fewer
  std::optional<Tensor<float>> next();

 private:
  int crf_;
  Index width_ = 0, height_ = 0, left_ = 0;
  std::unique_ptr<VideoWriter> writer_;
  std::vector<std::byte> file_;
  std::unique_ptr<VideoReader> reader_;
};

}  // namespace fieldmark::cli
