#pragma once
// A picture under distort::blur(), without a tape. Private.
#include <fieldmark/distort/blur.h>
#include <fieldmark/engine/tensor.h>

namespace fieldmark::watermark {

inline Tensor<float> blurred(const Tensor<float>& picture, double sigma) {
  if (sigma <= 0) return picture;
  Tape<float> tape;
  const auto deviation = static_cast<float>(sigma);
  const Var<float> y = distort::blur(tape.constant(picture), tape.constant(&deviation, {1}));
  return {y.shape(), std::vector<float>(y.value(), y.value() + y.shape().size())};
}

}  // namespace fieldmark::watermark
