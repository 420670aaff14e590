#pragma once
#include <fieldmark/engine/tensor.h>

#include <array>
#include <span>

namespace fieldmark::watermark {

/// Change of colour between a render and an image, the same at every pixel:
///   t_c(v) = a_c + sum_k b_ck v_k + d_c max(v) + e_c min(v) + f_c v_c ln v_c
/// The sum mixes channels: greyscale, sepia, white balance. max(v) and min(v) make a hue rotation by 180
/// degrees exact: t_c = max(v) + min(v) - v_c. v ln v models a gamma near 1:
/// v^(1 + e) = v + e v ln v + ...
struct ToneFit {
  static constexpr std::size_t kTerms = 7;  ///< 1, red, green, blue, max, min, v ln v
  /// Terms per channel; by default the identity.
  std::array<std::array<double, kTerms>, 3> terms{
      {{0, 1, 0, 0, 0, 0, 0}, {0, 0, 1, 0, 0, 0, 0}, {0, 0, 0, 1, 0, 0, 0}}};
  /// Returns t(v). @param v  [3] in [0, 1]
  std::array<double, 3> at(const float* v) const;
  /// Returns dt_c / dv_k in [c][k]; in the logarithm, v is at least 0.02.
  std::array<std::array<double, 3>, 3> slope(const float* v) const;
  /// Applies t to every pixel.   @param image  [H, W, 3]
  Tensor<float> operator()(const Tensor<float>& image) const;
};

/// Fits the terms by weighted least squares, regularised towards the identity with the weight of 0.01% more,
/// unchanged pixels, so that a constant render keeps its gain.
/// @param render, image  [H, W, 3] in [0, 1]   @param weight  [H W] >= 0; all 0 gives the identity
/// @throws ShapeError if shapes differ
ToneFit fit_tones(const Tensor<float>& render, const Tensor<float>& image, std::span<const double> weight);

}  // namespace fieldmark::watermark
