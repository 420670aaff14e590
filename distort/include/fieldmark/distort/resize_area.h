#pragma once
#include <fieldmark/engine/tape.h>
#include <fieldmark/engine/tensor.h>

#include <cstdint>

namespace fieldmark::distort {

/// Resizes an image with an area (box) filter: each output pixel is the mean of x over its own rectangle.
///   y(i, j) = sum_rs a_ir b_js x(r, s),   a_ir = |[i, i+1] H/h  cut with  [r, r+1]| h/H, b alike
/// The weights are exact ratios of integers. The same size is the exact identity, and the mean is preserved.
/// @param x  [height, width, channels], height and width at least 1
/// @param height, width  of the result, at least 1; any ratio, including enlargement
/// @return [height, width, channels]
/// @throws ShapeError if x is not an image of at least one pixel   @throws ValueError on height or width
/// Differentiable in: x.
template <class T>
Var<T> resize_area(Var<T> x, Index height, Index width);

/// Resizes labels [height, width] to match resize_area: takes the label under the centre of each new pixel.
/// @throws as above
Tensor<std::int32_t> resize_labels(const Tensor<std::int32_t>& labels, Index height, Index width);

}  // namespace fieldmark::distort
