#pragma once
#include <fieldmark/engine/tensor.h>

namespace fieldmark {

/// Resizes with an exact area filter: each output pixel is the mean of the input in the rectangle it covers.
///   y_i = (1 / s) integral_{i s}^{(i + 1) s} x(t) dt along each axis, x constant over a pixel, s = in / out
/// Preserves the mean of the image; the same size is the identity.
/// @param image  [H, W, C]   @param height, width  at least 1   @return [height, width, C]
/// @throws ShapeError unless image is [H, W, C] with H, W >= 1   @throws ValueError unless both sizes are
/// positive
Tensor<float> resize_area(const Tensor<float>& image, Index height, Index width);

/// Resizes by linear interpolation between pixel centres; border pixels extend outwards. Without a prefilter,
/// so it aliases when it shrinks.
///   x_i = (i + 1/2) in / out - 1/2
/// Parameters, result and errors as resize_area().
Tensor<float> resize_bilinear(const Tensor<float>& image, Index height, Index width);

/// Kernels of resize_filtered().
enum class ResizeFilter {
  nearest,   ///< the pixel under the new pixel's centre
  bilinear,  ///< triangle of half width 1
  bicubic,   ///< Keys 1981 with a = -1/2, half width 2
  lanczos    ///< sinc windowed by its own first three lobes, half width 3
};

/// Resizes as image editors do: the kernel stretches when the image shrinks, which avoids aliasing, and its
/// weights are normalised to sum to 1, also at the border.
///   y_i = sum_k w_k x_k / sum_k w_k,   w_k = f((k + 1/2 - c_i) / max(s, 1)),   c_i = (i + 1/2) s,
///   s = in / out
/// The same size is the identity. bicubic and lanczos may leave the range of x. `nearest` does not stretch.
/// Parameters, result and errors as resize_area().
Tensor<float> resize_filtered(const Tensor<float>& image, Index height, Index width, ResizeFilter filter);

}  // namespace fieldmark
