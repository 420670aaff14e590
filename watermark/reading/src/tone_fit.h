#pragma once
#include <fieldmark/engine/tensor.h>

#include <array>
#include <span>
#include <vector>

namespace fieldmark::watermark {

/// Change of colour between a render and an image, the same at every pixel:
///   t_c(v) = a_c + sum_k b_ck v_k + d_c max(v) + e_c min(v) + f_c v_c ln v_c + g_c v_c^2
/// The sum mixes channels: greyscale, sepia, white balance. max(v) and min(v) make a hue rotation by 180
/// degrees exact: t_c = max(v) + min(v) - v_c. v ln v models a gamma near 1: v^(1 + e) = v + e v ln v + ...
/// With v^2, powers of 0.7 to 2.2 have an RMS error below 0.0015 over [0, 1].
struct ToneFit {
  static constexpr std::size_t kTerms = 8;  ///< 1, red, green, blue, max, min, v ln v, v^2
  /// Terms per channel; by default the identity.
  std::array<std::array<double, kTerms>, 3> terms{
      {{0, 1, 0, 0, 0, 0, 0, 0}, {0, 0, 1, 0, 0, 0, 0, 0}, {0, 0, 0, 1, 0, 0, 0, 0}}};
  /// Returns t(v). @param v  [3] in [0, 1]
  std::array<double, 3> at(const float* v) const;
  /// Returns dt_c / dv_k in [c][k]; in the logarithm, v is at least 0.02.
  std::array<std::array<double, 3>, 3> slope(const float* v) const;
  /// Applies t to every pixel.   @param image  [H, W, 3]
  Tensor<float> operator()(const Tensor<float>& image) const;
};

/// Fits the terms by weighted least squares, regularised towards the identity, so that a constant render
/// keeps its gain.
/// @param render, image  [H, W, 3] in [0, 1]   @param weight  [H W] >= 0; all 0 gives the identity
/// @param hold  weight of the identity relative to that of all pixels, > 0; more bends less
/// @throws ShapeError if shapes differ
ToneFit fit_tones(const Tensor<float>& render, const Tensor<float>& image, std::span<const double> weight,
                  double hold = 1e-6);

/// Deviations at which a residual has half the weight: 95% efficiency for Gaussian residuals.
inline constexpr double kCauchy = 2.385;

/// A fit to which pixels that differ by far more than the rest hardly count: captions, clipped colours.
struct RobustTones {
  ToneFit tones;
  Tensor<float> toned;       ///< t(render), [H, W, 3]
  std::vector<double> rest;  ///< image - toned, [H, W, 3]
  double spread = 0;         ///< 1.4826 median |rest| over pixels with weight, at least half a grey level
};

/// Fits the terms `passes` times. After each time, the weight of a pixel with residual r is
///   weight / (1 + |r|^2 / (3 (kCauchy spread)^2)).
/// @param passes  >= 1   @param weight  [H W] 0 or 1; all 0 gives the identity and no spread
/// @throws ShapeError as fit_tones()
RobustTones fit_tones_robustly(const Tensor<float>& render, const Tensor<float>& image,
                               const std::vector<double>& weight, int passes, double hold = 1e-6);

}  // namespace fieldmark::watermark
