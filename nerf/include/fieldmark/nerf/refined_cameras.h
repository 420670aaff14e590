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

/// Moves the cameras of images to where a fixed hash field shows these images: gradient descent through
/// volume rendering on six numbers per camera and an exposure per image. For motions on the order of degrees.
/// Source: Lin et al. 2021 (BARF), sec. 4.2, which measures test images this way.
/// @param progress  called from time to time; returns false to stop with the cameras so far. May be empty
/// @throws ValueError if there are no views, or the field is an mlp field
std::vector<Camera> fit_cameras(const RadianceField& field, const Dataset& data,
                                const CameraFitOptions& options = {},
                                const std::function<bool(Index done, Index total)>& progress = {});

/// Mean differences between two lists of cameras.
struct CameraMotion {
  double degrees = 0;   ///< between their axes
  double distance = 0;  ///< between their positions, length
};
/// @param from, to  of the same images   @throws ShapeError if their numbers differ
CameraMotion mean_motion(std::span<const Camera> from, std::span<const Camera> to);

/// Returns the text of a transforms.json: intrinsics, image size and matrix of each camera, under the names
/// of the views.
/// @throws ShapeError if their numbers differ
std::string format_transforms(std::span<const View> views, std::span<const Camera> cameras);

}  // namespace fieldmark::nerf
