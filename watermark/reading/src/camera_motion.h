#pragma once
#include <fieldmark/nerf/camera.h>

#include <array>

namespace fieldmark::watermark {

/// Where a camera's image shows a point.
struct Projection {
  double x = 0;      ///< pixels from the image's left edge
  double y = 0;      ///< pixels from the image's upper edge
  double depth = 0;  ///< along the viewing direction, length; x and y hold where it is positive
};

/// The inverse of pixel_ray().
///   q = R^T (p - t),   x = cx - fx q_x / q_z,   y = cy + fy q_y / q_z,   depth = -q_z
Projection project(const nerf::Camera& camera, const nerf::Vec3& point);

/// A small change of a camera that also says how its image was cut and scaled: turn about the camera's
/// three axes, radians; shift along them, in depths of the pivot; zoom, the logarithm of a factor of both
/// focal lengths; slide of the principal point right and down, in widths of the image. All are of the order
/// of what they move, as a part of the image.
using CameraMotion = std::array<double, 9>;

/// The camera after a motion: in its axes a point q goes to exp(turn) (q - m) + m + d shift, where m is the
/// pivot and d its depth.   @param pivot  in the world, at a positive depth
nerf::Camera moved(const nerf::Camera& camera, const nerf::Vec3& pivot, const CameraMotion& motion);

/// Derivatives of a point's x and y, pixels, by the motion, where there is none.
/// @param point  at a positive depth
std::array<CameraMotion, 2> motion_gradient(const nerf::Camera& camera, const nerf::Vec3& pivot,
                                            const nerf::Vec3& point);

}  // namespace fieldmark::watermark
