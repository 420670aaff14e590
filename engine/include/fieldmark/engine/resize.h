#pragma once
#include <fieldmark/engine/tensor.h>

namespace fieldmark {

/// Resizes with an exact area filter: an output pixel is the mean of the input over the rectangle it covers.
///   y_i = (1 / s) integral_{i s}^{(i + 1) s} x(t) dt along each axis, x constant over a pixel, s = in / out
/// The mean of the picture is kept, and the same size is the identity.
/// @param image  [H, W, C]   @param height, width  at least 1   @return [height, width, C]
/// @throws ShapeError unless image is [H, W, C] with H, W >= 1   @throws ValueError unless both sizes are
/// positive
Tensor<float> resize_area(const Tensor<float>& image, Index height, Index width);

/// Resizes by linear interpolation between pixel centres, the border pixel beyond the outermost ones; no
/// filter, so it aliases where it shrinks.
///   x_i = (i + 1/2) in / out - 1/2
/// Parameters, result and errors as resize_area().
Tensor<float> resize_bilinear(const Tensor<float>& image, Index height, Index width);

}  // namespace fieldmark
