#include "cli/view_output.h"

#include <fieldmark/core/files.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/image.h>

#include <algorithm>
#include <utility>

namespace fieldmark::cli {

Tensor<float> with_alpha(const nerf::Rendering& view, nerf::Background background) {
  const Index pixels = view.opacity.size();
  const float behind = nerf::background_value(background);
  Tensor<float> image({view.rgb.shape[0], view.rgb.shape[1], 4});
  for (Index i = 0; i < pixels; ++i) {
    const float alpha = view.opacity[i];
    for (Index c = 0; c < 3 && alpha > 0; ++c)
      image[4 * i + c] = std::clamp((view.rgb[3 * i + c] - (1 - alpha) * behind) / alpha, 0.f, 1.f);
    image[4 * i + 3] = alpha;
  }
  return image;
}

bool is_video_path(const std::string& path) {
  std::string end = std::filesystem::path(path).extension().string();
  std::ranges::transform(end, end.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c + 32) : c; });
  return end == ".mp4";
}

ViewOutput::ViewOutput(std::filesystem::path out, double frames_per_second)
    : out_(std::move(out)), frames_per_second_(frames_per_second) {}

ViewOutput::~ViewOutput() = default;

void ViewOutput::wait() {
  if (last_.valid()) last_.get();
}

std::filesystem::path ViewOutput::add(const std::string& name, Tensor<float> image) {
  wait();
  const bool frame = is_video_path(out_.string());
  const std::filesystem::path path = frame ? out_ : out_ / (name + ".png");
  if (frame && !video_)
    video_ = std::make_unique<VideoWriter>(image.shape[1], image.shape[0],
                                           VideoOptions{.frames_per_second = frames_per_second_});
  auto write = [this, frame, path, image = std::move(image)] {
    if (frame)
      video_->add(image);
    else
      write_png(path, image);
  };
  if (threads() == 1)
    write();
  else
    last_ = std::async(std::launch::async, std::move(write));
  return path;
}

void ViewOutput::finish() {
  wait();
  if (video_) write_file_atomically(out_, video_->finish());
}

}  // namespace fieldmark::cli
