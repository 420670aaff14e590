#include "cli/h264_clip.h"

#include <fieldmark/core/error.h>

#include <algorithm>

namespace fieldmark::cli {

H264Clip::H264Clip(int crf) : crf_(crf) { VideoWriter(2, 2, {.crf = crf}); }

void H264Clip::add(const Tensor<float>& image, const std::string& name) {
  const Index height = image.shape[0], width = image.shape[1];
  if (!writer_) {
    width_ = width, height_ = height;
    writer_ = std::make_unique<VideoWriter>(width, height, VideoOptions{.crf = crf_});
  }
  if (width != width_ || height != height_)
    throw IoError(name + ": expected an image of " + std::to_string(width_) + " x " +
                  std::to_string(height_) + " pixels as the first of the clip, found " +
                  std::to_string(width) + " x " + std::to_string(height) + "; h264 takes images of one size");
  writer_->add(image);
  ++left_;
}

std::optional<Tensor<float>> H264Clip::next() {
  if (left_ == 0) return std::nullopt;
  if (!reader_) {
    file_ = writer_->finish();
    writer_.reset();
    reader_ = std::make_unique<VideoReader>(file_, "H.264 in memory");
  }
  const auto frame = reader_->next();
  if (!frame)
    throw IoError("H.264 in memory: expected " + std::to_string(left_) + " more frames, found none");
  --left_;
  // The sides are even in the file.
  Tensor<float> image({height_, width_, 3});
  for (Index y = 0; y < height_; ++y)
    std::copy_n(frame->image.data.begin() + 3 * y * frame->image.shape[1], 3 * width_,
                image.data.begin() + 3 * y * width_);
  return image;
}

}  // namespace fieldmark::cli
