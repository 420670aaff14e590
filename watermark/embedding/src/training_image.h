#pragma once
#include <fieldmark/watermark/embedding/embedder.h>

#include <array>

namespace fieldmark::watermark {

// Everything random about one training image.
struct Embedder::Image {
  Index view;
  std::uint64_t step, image;
  Message message;
  std::vector<std::int8_t> signs;
  std::array<float, 6> warp;
  bool warped;
  float blur, noise;
  double target;  // rms of the residual on the object
};

}  // namespace fieldmark::watermark
