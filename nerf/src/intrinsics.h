#pragma once
#include <fieldmark/nerf/camera.h>
#include "lens.h"

#include <optional>

namespace fieldmark::nerf {

/// What a file states of a camera besides its pose; the rest follows from the image.
struct Intrinsics {
  double angle_x = 0;          ///< horizontal field of view, radians, in (0, pi); 0: not stated
  double angle_y = 0;          ///< vertical field of view, radians, in (0, pi); 0: not stated
  double fl_x = 0;             ///< focal length across, pixels, before angle_x; 0: not stated
  double fl_y = 0;             ///< focal length down, pixels, before angle_y; 0: as across
  std::optional<double> cx{};  ///< principal point from the left edge, pixels; none: the middle
  std::optional<double> cy{};  ///< principal point from the upper edge, pixels; none: the middle
  Index width = 0;             ///< pixels of the image that these hold for; 0: any
  Index height = 0;            ///< pixels of the image that these hold for; 0: any
  Lens lens{};                 ///< distortion, alike at every size

  /// The pinhole for an image of this size: lengths in pixels are scaled from the size stated to that of the
  /// image. Where only angle_x is stated, it is make_camera().
  /// @throws ValueError  if neither fl_x nor angle_x is stated, or the image is not the stated one scaled
  ///                     (each side to within a pixel)
  Camera camera(const Pose& pose, Index image_width, Index image_height) const;
};

}  // namespace fieldmark::nerf
