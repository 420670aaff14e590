#pragma once
#include <fieldmark/engine/tensor.h>

#include <array>
#include <span>

namespace fieldmark::watermark {

/// What became of a render's values in an image, channel by channel:
///   t(v) = offset + gain v + bend v ln v,   v ln v being what a gamma near 1 adds: v^(1 + e) = v + e v ln v
///   +
///   ...
struct ToneFit {
  std::array<double, 3> offset{};       ///< added
  std::array<double, 3> gain{1, 1, 1};  ///< factor
  std::array<double, 3> bend{};         ///< of v ln v
  /// t(v). @param v  in [0, 1]
  double at(Index channel, double v) const;
  /// dt/dv, with v no closer to 0 than 0.02.
  double slope(Index channel, double v) const;
};

/// The tones that explain an image by a render, by weighted least squares. They are held near no change as
/// if 1% more pixels had shown none, so that a plain render keeps its gain.
/// @param render, image  [H, W, 3] in [0, 1]   @param weight  [H W] >= 0; without any there is no change
/// @throws ShapeError if shapes differ
ToneFit fit_tones(const Tensor<float>& render, const Tensor<float>& image, std::span<const double> weight);

}  // namespace fieldmark::watermark
