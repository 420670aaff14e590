#pragma once
// What people put an image into: bars, a different background, a caption, a collage.
#include <fieldmark/engine/tensor.h>

#include <array>
#include <functional>
#include <span>

namespace fieldmark::distort {

/// Adds black bars left and right up to the aspect 16 : 9; unchanged if the image already has it or is wider.
Tensor<float> pillarboxed(const Tensor<float>& x);
/// Adds black bars above and below up to the aspect 16 : 9; unchanged if the image has it or is taller.
Tensor<float> letterboxed(const Tensor<float>& x);
/// Replaces pixels that equal the background to within half a grey level.
/// @param fill  returns the value of a pixel, in [0, 1]
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
/// Draws an image of discs that cover one another, like fallen leaves: each has one colour, and radii from a
/// fiftieth to half of the longer side occur with a density of r^-3, which gives edges and plain areas of all
/// sizes as images of nature have them. Source: Lee, Mumford and Huang, "Occlusion models for natural
/// images", IJCV 2001.
/// @param draw  returns four uniform numbers in [0, 1) of a counter
Tensor<float> dead_leaves(Index height, Index width, const std::function<std::array<float, 4>(Index)>& draw);
/// Draws an opaque black bar with white lines, like text, over the middle fifth of the height.
Tensor<float> captioned(const Tensor<float>& x);
/// Tiles four copies of the image at half size, two by two, on a canvas of its size.
Tensor<float> collage(const Tensor<float>& x);
/// Applies the sepia matrix of the W3C filter effects.
Tensor<float> sepia(const Tensor<float>& x);

}  // namespace fieldmark::distort
