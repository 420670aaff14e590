#pragma once
#include <fieldmark/engine/tensor.h>

#include <array>
#include <span>
#include <vector>

namespace fieldmark::watermark {

/// Orthonormal axes of colour, one per row.
using ColourAxes = std::array<std::array<float, 3>, 3>;

/// Returns the axes along which a residual is uncorrelated: the eigenvectors of
///   C = mean over p of r_p r_p^T / V_p,
/// where r_p is the residual of pixel p and V_p the power around it, so that every place counts alike. The
/// noise of a render is mostly of lightness and correlates all channels, so a channel by itself hides what
/// the difference of two shows.
/// @param rest  [H, W, 3]   @param power  [H, W, 3] around each pixel, >= 0
/// @param on_object  [H W] 1 where a pixel counts, else 0; without any, the axes are those of RGB
ColourAxes uncorrelated_axes(const Tensor<float>& rest, const Tensor<float>& power,
                             const std::vector<double>& on_object);

/// Replaces colours by their components along the axes.
/// @param colours  triples
void turn(std::span<float> colours, const ColourAxes& axes);

}  // namespace fieldmark::watermark
