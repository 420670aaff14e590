#pragma once
#include <fieldmark/nerf/camera.h>
#include "lens.h"

#include <optional>

namespace fieldmark::nerf {

/// The intrinsics that a file states of a camera; the rest follows from the image.
struct Intrinsics {
  double angle_x = 0;          ///< horizontal field of view, radians, in (0, pi); 0: not stated
  double angle_y = 0;          ///< vertical field of view, radians, in (0, pi); 0: not stated
  double fl_x = 0;             ///< horizontal focal length, pixels, wins over angle_x; 0: not stated
  double fl_y = 0;             ///< vertical focal length, pixels, wins over angle_y; 0: as fl_x
  std::optional<double> cx{};  ///< principal point from the left edge, pixels; none: the middle
  std::optional<double> cy{};  ///< principal point from the upper edge, pixels; none: the middle
  Index width = 0;             ///< pixels of the image that these hold for; 0: any
  Index height = 0;            ///< pixels of the image that these hold for; 0: any
  Lens lens{};                 ///< distortion, alike at every size

  /// The pinhole for an image of this size, with lengths in pixels scaled to it from the stated size.
  /// @throws ValueError  if neither fl_x nor angle_x is stated, or the image is not the stated one scaled
  ///                     (each side to within a pixel)
  Camera camera(const Pose& pose, Index image_width, Index image_height) const;
};

}  // namespace fieldmark::nerf
