#include "cli/view_output.h"

#include <fieldmark/core/files.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/image.h>

#include <algorithm>
#include <utility>

#include "cli/images.h"

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

bool is_video_path(const std::string& path) { return extension_of(path) == ".mp4"; }

ViewOutput::ViewOutput(std::filesystem::path out, Index width, Index height, double frames_per_second)
    : out_(std::move(out)) {
  if (is_video_path(out_.string()))
    video_ =
        std::make_unique<VideoWriter>(width, height, VideoOptions{.frames_per_second = frames_per_second});
}

ViewOutput::~ViewOutput() = default;

void ViewOutput::wait() {
  if (last_.valid()) last_.get();
}

std::filesystem::path ViewOutput::add(const std::string& name, Tensor<float> image) {
  wait();
  const std::filesystem::path path = video_ ? out_ : out_ / (name + ".png");
  auto write = [this, path, image = std::move(image)] {
    if (video_)
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
