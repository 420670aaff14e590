#pragma once
#include "carriers.h"

namespace fieldmark::watermark {

/// Likelihood of a mark in an image, per pixel of the foreground, along the axes of colour of the carriers.
struct MarkScore {
  Tensor<float> score;            ///< [H, W, 3] slope of the log-likelihood in the mark's change
  Tensor<float> precision;        ///< [H, W, 3] inverse variance of the noise, >= 0
  double blur = 0;                ///< standard deviation of the image's blur, pixels, see distort::blur()
  std::vector<double> on_object;  ///< [H W] 1 where a pixel counts, else 0
};

/// Estimated signs of the cells.
struct SignFit {
  std::vector<double> sign;  ///< [cells] in [-1, 1]; 0 for a hidden cell
  double noise = 0;          ///< lambda, see fit_signs()
  double explained = 0;      ///< share of g^2 / W, the weighted power of the residual, that the signs explain
};

/// Estimates the signs of all cells jointly, since a pixel shows several. With M_c the blurred carrier of
/// cell c, g the score and W the precision,
///   s = argmin  sum_p W (g / W - sum_c s_c M_c)^2 + lambda sum_c s_c^2,
///   sum_d (M_c . W M_d + lambda delta_cd) s_d = M_c . g,
/// by conjugate gradients: the linear minimum mean square error estimate of random signs (Kay 1993, ch. 12;
/// Madhow and Honig 1994). Plain correlation M_c . g would attribute the neighbours' carriers to cell c.
///
/// lambda corrects for residuals that are correlated between pixels: it is the power of M_c . g with the
/// score shifted to other places of the foreground, relative to that of independent noise of precision W.
/// Without noise and information, all signs are 0.
/// @param mark  of the image's size   @param cells  number of cells
/// @throws ShapeError if score, precision or on_object do not fit the mark
SignFit fit_signs(const Carriers& mark, const MarkScore& score, Index cells);

}  // namespace fieldmark::watermark
