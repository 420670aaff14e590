#include "intrinsics.h"
#include <fieldmark/core/error.h>

#include <cmath>
#include <string>

namespace fieldmark::nerf {

Camera Intrinsics::camera(const Pose& pose, Index image_width, Index image_height) const {
  if (!(fl_x > 0) && !(angle_x > 0)) throw ValueError("[camera] intrinsics: fl_x or angle_x must be stated");
  const auto w = static_cast<double>(image_width), h = static_cast<double>(image_height);
  const bool sized = width > 0 && height > 0;
  const double sx = sized ? w / static_cast<double>(width) : 1,
               sy = sized ? h / static_cast<double>(height) : 1;
  if (sized && std::abs(sx - sy) > 1 / static_cast<double>(width) + 1 / static_cast<double>(height))
    throw ValueError("[camera] image: must be of " + std::to_string(width) + " x " + std::to_string(height) +
                     " pixels as stated, or that scaled, got " + std::to_string(image_width) + " x " +
                     std::to_string(image_height));
  Camera c = angle_x > 0 ? make_camera(pose, angle_x, image_width, image_height)
                         : Camera{.pose = pose, .width = image_width, .height = image_height};
  if (fl_x > 0) c.fx = fl_x * sx;
  if (fl_y > 0)
    c.fy = fl_y * sy;
  else if (angle_y > 0)
    c.fy = 0.5 * h / std::tan(0.5 * angle_y);
  else if (fl_x > 0)
    c.fy = fl_x * sy;
  c.cx = cx ? *cx * sx : 0.5 * w;
  c.cy = cy ? *cy * sy : 0.5 * h;
  return c;
}

}  // namespace fieldmark::nerf
