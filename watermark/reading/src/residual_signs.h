#pragma once
#include <fieldmark/nerf/renderer.h>
#include <fieldmark/watermark/mark/owner.h>
#include "surround.h"

#include <vector>

namespace fieldmark::watermark {

/// Signs of the cells as the residual of one image shows them.
struct ResidualSigns {
  std::vector<double> sign;  ///< [cells] in [-1, 1], see fit_signs()
  bool lost_detail =
      false;  ///< to JPEG, a blur of a pixel or more, or less than 0.6 of the training images' scale
};

/// Subtracts the unmarked render from an image and estimates the signs from the rest.
///   - The blur of the render that leaves the smallest residual is kept; gain, offset and gamma of each
///     channel are fitted.
///   - With the residual R and its mean power V around each pixel, R / V is the score and 1 / V the
///   precision.
///     For a JPEG image both come from the quantised coefficients.
///   - Covered pixels do not count.
/// @throws ShapeError if the sizes differ
/// @param renderer  of the owner's field   @param seen  image, and what covers it
/// @param camera  of the image's size
ResidualSigns residual_signs(nerf::Renderer& renderer, const Owner& owner, const Surround& seen,
                             const nerf::Camera& camera);

}  // namespace fieldmark::watermark
