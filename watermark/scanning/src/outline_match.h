#pragma once
#include <fieldmark/engine/tensor.h>
#include <fieldmark/watermark/mark/object_window.h>

#include <array>
#include <optional>
#include <vector>

namespace fieldmark::watermark {

/// A part of a render on a grid, cut out along its outline.
struct Outline {
  Index height = 0, width = 0;                ///< of the grid
  std::vector<Index> y, x;                    ///< of the pixels inside
  std::array<std::vector<float>, 3> of_mean;  ///< their colours less the mean, unit length over all channels
};

/// Cuts a part out of a render.
/// @param rgb, opacity  [H, W, 3], the opacity in all channels   @param window  around the part
/// @param grid  pixels of its longer side
/// @return nothing if fewer than `least` pixels are inside, or the part is plain
/// @throws ValueError if the window has no extent
std::optional<Outline> outline_of(const Tensor<float>& rgb, const Tensor<float>& opacity,
                                  const Window& window, Index grid, Index least);

/// An image at a size at which outlines are compared with it.
struct ResizedImage {
  Index height = 0, width = 0;              ///< resized
  double zoom_x = 0, zoom_y = 0;            ///< resized pixels per pixel
  std::array<std::vector<float>, 3> plane;  ///< colours
  std::vector<float> squares;               ///< sum of the squares of all channels
};

/// Resizes an image: area filter where it shrinks, bilinear where it grows, as cut_window().
/// @param rgb  [H, W, 3]   @param zoom  resized pixels per pixel, positive
ResizedImage resized_image(const Tensor<float>& rgb, double zoom);

/// A place of an outline in a resized image.
struct OutlineMatch {
  double likeness = -1;  ///< as of ObjectSearch
  Index row = 0, column = 0;
};

/// Returns the place in the whole image that looks most like the outline, the first of equal ones; likeness
/// -1 if the outline does not fit or every place is plain.
OutlineMatch best_match(const Outline& outline, const ResizedImage& image);

/// Returns the same among the places up to `reach` rows and columns from one.
OutlineMatch best_match_near(const Outline& outline, const ResizedImage& image, Index row, Index column,
                             Index reach);

}  // namespace fieldmark::watermark
