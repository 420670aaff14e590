#pragma once
#include <fieldmark/engine/tensor.h>

#include <algorithm>

namespace fieldmark {

/// Mirrors an image left to right.   @param image  [H, W, C]
inline Tensor<float> mirrored(const Tensor<float>& image) {
  const Index w = image.shape[1], channels = image.shape[2];
  Tensor<float> out(image.shape);
  for (Index p = 0; p < image.shape[0] * w; ++p)
    std::copy_n(image.data.begin() + p * channels, channels,
                out.data.begin() + (p - p % w + w - 1 - p % w) * channels);
  return out;
}

}  // namespace fieldmark
