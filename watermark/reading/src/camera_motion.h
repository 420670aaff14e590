#pragma once
#include <fieldmark/nerf/camera.h>

#include <array>

namespace fieldmark::watermark {

/// Projection of a point.
struct Projection {
  double x = 0;      ///< pixels from the image's left edge
  double y = 0;      ///< pixels from the image's upper edge
  double depth = 0;  ///< along the viewing direction, length; x and y are valid if positive
};

/// Projects a point: the inverse of pixel_ray().
///   q = R^T (p - t),   x = cx - fx q_x / q_z,   y = cy + fy q_y / q_z,   depth = -q_z
Projection project(const nerf::Camera& camera, const nerf::Vec3& point);

/// Small motion of a camera, including crop and scale of its image: rotation about its three axes, radians;
/// translation along them, in depths of the pivot; logarithm of a factor on both focal lengths; shift of the
/// principal point right and down, in widths of the image; logarithm of a factor on the horizontal focal
/// length alone, for a stretched image. All are of the order of the relative displacement in the image.
using CameraMotion = std::array<double, 10>;

/// Moves a camera: in its axes a point q goes to exp(turn) (q - m) + m + d shift, where m is the pivot and d
/// its depth.   @param pivot  in the world, at a positive depth
nerf::Camera moved(const nerf::Camera& camera, const nerf::Vec3& pivot, const CameraMotion& motion);

/// Computes the derivatives of a point's x and y, pixels, by the motion, at rest.
/// @param point  at a positive depth
std::array<CameraMotion, 2> motion_gradient(const nerf::Camera& camera, const nerf::Vec3& pivot,
                                            const nerf::Vec3& point);

}  // namespace fieldmark::watermark
