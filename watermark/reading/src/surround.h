#pragma once
#include <fieldmark/engine/tensor.h>
#include <fieldmark/nerf/radiance_field.h>

#include <array>
#include <vector>

namespace fieldmark::watermark {

/// An image without surroundings added by others: bars, and another background behind an object.
struct Surround {
  Tensor<float> image;  ///< [H, W, 3] with bars cut off, the plain background replaced by the field's
  Tensor<float> plain;  ///< [H, W, 3] the same pixels as they came; empty if no background was replaced
  Index left = 0;       ///< columns cut off at the left edge
  Index top = 0;        ///< rows cut off at the upper edge
  std::array<float, 3> colour{};  ///< of the background in `plain`
  /// [H W] 1 where a bar covers the view, else 0; empty if none does. `image` has the background there.
  std::vector<std::uint8_t> covered{};
};

/// Returns the image with bars cut off, before the background with which it came.
inline const Tensor<float>& own_image(const Surround& seen) {
  return seen.plain.size() > 0 ? seen.plain : seen.image;
}

/// Removes the surround. Rows or columns of one colour at opposite edges are bars and are cut off, unless
/// they have the field's background colour. In the rest of an object's image, the background is the colour of
/// most pixels at the edges (within 0.03 in every channel), or of bars on all four sides. Pixels connected to
/// the edges in that colour (within 0.06) take the field's background. A bar of one colour from edge to edge,
/// such as a caption's, covers the object. An image that already has the field's background is unchanged.
/// @param image  [H, W, 3] in [0, 1]   @param background  of the field
/// @param object  true if the field shows an object before a plain background
Surround clear_surround(const Tensor<float>& image, float background, bool object);

/// Puts an image before another plain background, by the opacity of a render of the same view: exact at
/// edges, too.
///   y = x + (1 - opacity) (to - from)
/// @param image  [H, W, 3]   @param opacity  [H, W]   @param from, to  colours of the two backgrounds
/// @throws ShapeError if these do not fit
Tensor<float> before_background(const Tensor<float>& image, const Tensor<float>& opacity,
                                const std::array<float, 3>& from, const std::array<float, 3>& to);

}  // namespace fieldmark::watermark
