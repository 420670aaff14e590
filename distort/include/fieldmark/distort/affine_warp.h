#pragma once
#include <fieldmark/engine/tape.h>
#include <fieldmark/engine/tensor.h>

#include <cstdint>
#include <span>
#include <type_traits>

namespace fieldmark::distort {

/// Size and background of affine_warp().
template <class T>
struct WarpOptions {
  Index height = 0;                    ///< rows of the result; 0 = as many as x has
  Index width = 0;                     ///< columns of the result; 0 = as many as x has
  std::span<const T> background = {};  ///< [channels] colour outside x; empty = 0. Copied
};

/// Resamples an image once, bilinearly, under an affine map about the centres of both images.
///   y(p) = sum_q x(q) max(0, 1 - |q_x - s_x|) max(0, 1 - |q_y - s_y|),   s = A (p - c_out) + t + c_in
/// where q runs over pixels, and x has the background's colour outside. Integer positions copy pixels
/// exactly.
/// @param x       [height, width, channels]
/// @param matrix  [6] = [a00, a01, t_x, a10, a11, t_y] from output to input offsets, pixels, x right and
///                y down; see similarity(). Non-finite positions read the background
/// @return [options.height, options.width, channels]
/// @throws ShapeError if x is not an image, matrix not [6], or the background not [channels]
/// Differentiable in: x, matrix. Kinks in matrix where a position is an integer (gradient from above).
template <class T>
Var<T> affine_warp(Var<T> x, Var<T> matrix, WarpOptions<std::type_identity_t<T>> options = {});

/// Warps integer labels to match affine_warp: takes the nearest pixel's label, `background` outside.
/// @param labels  [height, width]   @param matrix  [6] as above   @param height, width  0 = as labels
/// @return [height, width]
/// @throws ShapeError if labels is not [height, width] or matrix is not [6]
Tensor<std::int32_t> warp_labels(const Tensor<std::int32_t>& labels, std::span<const float> matrix,
                                 std::int32_t background, Index height = 0, Index width = 0);

}  // namespace fieldmark::distort
