#pragma once
#include <fieldmark/nerf/renderer.h>
#include <fieldmark/watermark/mark/owner.h>
#include "evidence_view.h"

#include <vector>

namespace fieldmark::watermark {

/// Signs of the cells as the residual of one image shows them.
struct ResidualSigns {
  std::vector<double> sign;  ///< [cells] in [-1, 1], see fit_signs()
  bool lost_detail = false;  ///< to JPEG, to a blur of a pixel or more, or because it is small
};

/// Subtracts the unmarked render from an image and estimates the signs from the rest.
///   - The blur of the render that leaves the smallest residual is kept; a change of colour is fitted, see
///     ToneFit. Of a JPEG image, the likeliest of the renders with and without blur and change is kept, over
///     the field's background and over the image's.
///   - With the residual R and its mean power V around each pixel, R / V is the score and 1 / V the
///     precision. For a JPEG image both come from the quantised coefficients.
///   - If the signs explain less than a tenth of the residual, which then is mostly noise, they are estimated
///     again along axes of colour in which the residual is uncorrelated, see uncorrelated_axes().
///   - Covered pixels do not count; in a JPEG image, neither do the blocks of 16 x 16 pixels around them.
/// @param renderer  of the owner's field   @throws ShapeError if the sizes of image and camera differ
ResidualSigns residual_signs(nerf::Renderer& renderer, const Owner& owner, const EvidenceView& image);

}  // namespace fieldmark::watermark
