#pragma once
// What people put an image into: bars in its middle, another background, a caption, a collage.
#include <fieldmark/engine/tensor.h>

#include <array>
#include <span>

namespace fieldmark::distort {

/// Black bars left and right, or above and below, to the aspect 16 : 9; without change where the image has it
/// or exceeds it.
Tensor<float> pillarboxed(const Tensor<float>& x);
/// The same above and below.
Tensor<float> letterboxed(const Tensor<float>& x);
/// Pixels that have the old background to half a grey level take another.
/// @param fill  of a pixel, in [0, 1]
template <class F>
Tensor<float> before_another(const Tensor<float>& x, std::span<const float> background, F fill) {
  Tensor<float> y = x;
  for (Index p = 0; p < x.size() / 3; ++p) {
    bool plain = true;
    for (Index c = 0; c < 3; ++c) {
      const float d = x[3 * p + c] - background[static_cast<std::size_t>(c)];
      plain = plain && d * d <= 0.25f / (255 * 255);
    }
    if (!plain) continue;
    const std::array<float, 3> colour = fill(p);
    for (Index c = 0; c < 3; ++c) y[3 * p + c] = colour[static_cast<std::size_t>(c)];
  }
  return y;
}
/// An opaque black bar with white lines, like text, over the middle fifth of the height.
Tensor<float> captioned(const Tensor<float>& x);
/// Four of the image at half its size, two by two, on a canvas of its size.
Tensor<float> collage(const Tensor<float>& x);
/// The usual sepia matrix of W3C's filter effects.
Tensor<float> sepia(const Tensor<float>& x);

}  // namespace fieldmark::distort
