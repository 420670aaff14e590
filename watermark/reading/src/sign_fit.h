#pragma once
#include "carriers.h"

namespace fieldmark::watermark {

/// What an image says about a mark in a view, pixel by pixel, of the object alone.
struct MarkScore {
  Tensor<float> score;      ///< [H, W, 3] slope of the log-likelihood in what the mark adds
  Tensor<float> precision;  ///< [H, W, 3] inverse variance of what is not the mark, >= 0
  double blur = 0;          ///< deviation, pixels, under which the image shows the mark, see distort::blur()
  std::vector<double> on_object;  ///< [H W] 1 where a pixel counts, else 0
};

/// Signs of cells that explain an image.
struct SignFit {
  std::vector<double> sign;  ///< [cells] in [-1, 1]; 0 where the view shows nothing of a cell
  double noise = 0;          ///< lambda, see fit_signs()
};

/// All cells at once, since pixels show the marks of several: with M_c the carrier of cell c under the blur,
/// g the score and W the precision,
///   s = argmin  sum_p W (g / W - sum_c s_c M_c)^2 + lambda sum_c s_c^2,
///   sum_d (M_c . W M_d + lambda delta_cd) s_d = M_c . g,
/// the linear estimate of least mean square error where signs are +-1 by chance (Kay 1993, ch. 12; among
/// mobile telephones: Madhow and Honig 1994), by conjugate gradients. A sum M_c . g alone would take its
/// neighbours' marks for its own.
///
/// lambda is how much larger sums with the score from elsewhere on the object are than those of noise of
/// precision W that is independent from pixel to pixel: differences are alike from pixel to pixel.
/// @param mark  of the image's size   @param cells  their number
/// @throws ShapeError if score, precision or on_object do not fit the mark
SignFit fit_signs(const Carriers& mark, const MarkScore& score, Index cells);

}  // namespace fieldmark::watermark
