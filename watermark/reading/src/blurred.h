#pragma once
// Applies distort::blur() to an image without a tape. Private.
#include <fieldmark/distort/blur.h>
#include <fieldmark/engine/tensor.h>

namespace fieldmark::watermark {

inline Tensor<float> blurred(const Tensor<float>& image, double sigma) {
  if (sigma <= 0) return image;
  Tape<float> tape;
  const auto deviation = static_cast<float>(sigma);
  const Var<float> y = distort::blur(tape.constant(image), tape.constant(&deviation, {1}));
  return {y.shape(), std::vector<float>(y.value(), y.value() + y.shape().size())};
}

}  // namespace fieldmark::watermark
