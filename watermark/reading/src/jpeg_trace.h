#pragma once
#include <fieldmark/engine/tensor.h>

#include <optional>

#include "jpeg_planes.h"

namespace fieldmark::watermark {

/// Detects JPEG compression: under the correct quantisation table, the coefficients of 8 x 8 blocks are
/// multiples of the steps (Fan and de Queiroz 2003). Blocks with a value of 0 or 1 do not count, because a
/// decoder clips there. Fails if the image was resized afterwards, or shifted by other numbers of pixels.
/// @param image  [H, W, 3] in [0, 1], in steps of 1/255   @param left, top  pixels that were cut off, >= 0
/// @return nothing if no table fits
std::optional<JpegTrace> find_jpeg(const Tensor<float>& image, Index left = 0, Index top = 0);

}  // namespace fieldmark::watermark
