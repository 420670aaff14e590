#pragma once
#include <fieldmark/distort/affine_warp.h>

namespace fieldmark::distort {

/// Zooms an image about its centre into an image of fixed size, bilinear: affine_warp of similarity(0, s,
/// 0). Scale 1 into the same size is the exact identity. Not a low-pass: to shrink below 0.5 use resize_area.
/// @param x        [height, width, channels]
/// @param scale    [1] > 0; above 1 enlarges, below 1 shrinks
/// @param options  size of the result (round(s height) fits the shrunken image exactly) and background
/// @return [options.height, options.width, channels]
/// @throws ShapeError and ValueError as affine_warp and similarity
/// Differentiable in: x, scale. Kinks as affine_warp.
template <class T>
Var<T> rescale(Var<T> x, Var<T> scale, WarpOptions<std::type_identity_t<T>> options = {});

/// Moves labels [height, width] as rescale moves colours: nearest, `background` outside. @throws as above
/// @param height, width  size of the result, 0 = as labels
template <class T>
Tensor<std::int32_t> rescale_labels(const Tensor<std::int32_t>& labels, T scale, std::int32_t background,
                                    Index height = 0, Index width = 0);

}  // namespace fieldmark::distort
