#pragma once
#include <fieldmark/nerf/radiance_field.h>

#include <cstdint>
#include <vector>

namespace fieldmark::watermark {

/// [H W] 1 where an image shows no scene but a plain border, as turning leaves it in the corners, else 0:
/// what hangs together with a corner and has its colour to 0.06 in every channel, under a blur of deviation
/// 0.5 pixels (thin wedges) or of 3 (noise of deviation 0.1 does not hide it), with 6 pixels around for the
/// blur. What is plain about a corner of the scene itself counts too; it says little.
/// @param image  [H, W, 3] in [0, 1]   @throws ShapeError if it is not
std::vector<std::uint8_t> plain_border(const Tensor<float>& image);

/// The same of an image of a field's scene if that fills its images; else empty, since an object's plain
/// background says where it ends.
std::vector<std::uint8_t> border_of(const nerf::RadianceField& field, const Tensor<float>& image);

/// The same at another size: 1 where any pixel within `reach` of the place was 1.
/// @param border  [H W]   @param to_height, to_width  at least 1   @throws ShapeError if a size is below 1 or
/// border is not [H W]
std::vector<std::uint8_t> border_at(const std::vector<std::uint8_t>& border, Index height, Index width,
                                    Index to_height, Index to_width, Index reach);

}  // namespace fieldmark::watermark
