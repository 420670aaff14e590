#pragma once
#include <fieldmark/engine/tensor.h>

#include <array>
#include <span>

namespace fieldmark::watermark {

/// Tone curve of each channel between a render and an image:
///   t(v) = offset + gain v + bend v ln v,   where v ln v stands for a gamma near 1: v^(1 + e) = v + e v ln v
///   + ...
struct ToneFit {
  std::array<double, 3> offset{};       ///< added
  std::array<double, 3> gain{1, 1, 1};  ///< factor
  std::array<double, 3> bend{};         ///< of v ln v
  /// t(v). @param v  in [0, 1]
  double at(Index channel, double v) const;
  /// dt/dv, with v no closer to 0 than 0.02.
  double slope(Index channel, double v) const;
};

/// Fits the tone curves by weighted least squares, regularised towards the identity as by 1% more pixels
/// without change, so that a constant render keeps its gain.
/// @param render, image  [H, W, 3] in [0, 1]   @param weight  [H W] >= 0; all 0 gives the identity
/// @throws ShapeError if shapes differ
ToneFit fit_tones(const Tensor<float>& render, const Tensor<float>& image, std::span<const double> weight);

}  // namespace fieldmark::watermark
