#pragma once
#include <fieldmark/nerf/radiance_field.h>

#include <cstdint>
#include <vector>

namespace fieldmark::watermark {

/// Returns [H W] 1 on the plain border that a rotation leaves in the corners, else 0. The border is the
/// region connected to a corner with its colour to 0.06 in every channel, after a blur of 0.5 pixels (thin
/// wedges) or 3 pixels (noise of standard deviation 0.1), dilated by 6 pixels. It may include plain parts of
/// the scene, which carry little information.
/// @param image  [H, W, 3] in [0, 1]   @throws ShapeError if it is not
std::vector<std::uint8_t> plain_border(const Tensor<float>& image);

/// Returns plain_border() for a field whose scene fills its images; else empty, since a plain background
/// shows an object's silhouette.
std::vector<std::uint8_t> border_of(const nerf::RadianceField& field, const Tensor<float>& image);

/// Resizes a border and dilates it by `reach` pixels.
/// @param border  [H W]   @param to_height, to_width  at least 1   @throws ShapeError if a size is below 1 or
/// border is not [H W]
std::vector<std::uint8_t> border_at(const std::vector<std::uint8_t>& border, Index height, Index width,
                                    Index to_height, Index to_width, Index reach);

}  // namespace fieldmark::watermark
