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
/// True if a pixel equals the background to within half a grey level.
inline bool is_background(const float* pixel, std::span<const float> background) {
  for (std::size_t c = 0; c < 3; ++c) {
    const float d = pixel[c] - background[c];
    if (!(d * d <= 0.25f / (255 * 255))) return false;
  }
  return true;
}
/// Replaces the pixels of the background.
/// @param fill  returns the value of a pixel, in [0, 1]
template <class F>
Tensor<float> before_another(const Tensor<float>& x, std::span<const float> background, F fill) {
  Tensor<float> y = x;
  for (Index p = 0; p < x.size() / 3; ++p) {
    if (!is_background(&x[3 * p], background)) continue;
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
/// A part of an image, and where and how large it is pasted; pixels.
struct PastedPart {
  Index top, left, height, width;              ///< of the part
  Index to_top, to_left, to_height, to_width;  ///< of its copy
};
/// Chooses one of four parts with about a quarter of the object's pixels each. A row halves the object and a
/// column each half, or first a column and then a row. If all pixels are background, the whole image counts
/// as the object.
/// @param scale  0 to 1   @param draw  four uniform numbers in [0, 1): which part, its new place down and
/// right, and the order
PastedPart quarter_of_object(const Tensor<float>& x, std::span<const float> background, double scale,
                             const std::array<float, 4>& draw);
/// Pastes the part, without its background, onto another image of the same size.
Tensor<float> pasted(const Tensor<float>& x, std::span<const float> background, const PastedPart& part,
                     Tensor<float> onto);
/// Applies the sepia matrix of the W3C filter effects.
Tensor<float> sepia(const Tensor<float>& x);

}  // namespace fieldmark::distort
