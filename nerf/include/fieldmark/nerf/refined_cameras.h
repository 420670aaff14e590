#pragma once
#include <fieldmark/nerf/radiance_field.h>

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace fieldmark::nerf {

/// Budget of fit_cameras().
struct CameraFitOptions {
  Index steps = 300;              ///< >= 1
  Index samples_per_step = 8192;  ///< of all images together, see TrainOptions
  std::uint64_t seed = 0;         ///< of the rays
};

/// The cameras of images, moved to where a hash field, which stays as it is, shows these images: gradients
/// through volume rendering in six numbers a camera, with an exposure of each image beside them. For motions
/// of about degrees. Source: Lin et al. 2021 (BARF), sec. 4.2, where test images are measured so.
/// @param progress  called from time to time; false stops with the cameras so far. May be empty
/// @throws ValueError if there are no views, or the field is an mlp field
std::vector<Camera> fit_cameras(const RadianceField& field, const Dataset& data,
                                const CameraFitOptions& options = {},
                                const std::function<bool(Index done, Index total)>& progress = {});

/// How far cameras are from others, in the mean.
struct CameraMotion {
  double degrees = 0;   ///< between their axes
  double distance = 0;  ///< between their positions, length
};
/// @param from, to  of the same images   @throws ShapeError if their numbers differ
CameraMotion mean_motion(std::span<const Camera> from, std::span<const Camera> to);

/// The text of a transforms.json: intrinsics and matrix of each camera, under the names of the views.
/// @throws ShapeError if their numbers differ
std::string format_transforms(std::span<const View> views, std::span<const Camera> cameras);

}  // namespace fieldmark::nerf
