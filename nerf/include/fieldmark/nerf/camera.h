#pragma once
#include <fieldmark/engine/shape.h>

#include <array>
#include <span>

namespace fieldmark::nerf {

/// A point or direction in the world: x, y, z.
using Vec3 = std::array<double, 3>;
/// Camera-to-world matrix [3, 4], row-major; its columns are the camera's right, up and backward axes and
/// position.
using Pose = std::array<double, 12>;

/// A half-line: origin + t * direction, t >= 0.
struct Ray {
  Vec3 origin;     ///< length
  Vec3 direction;  ///< unit
};

/// Pinhole camera with OpenGL (Blender) axes: x right, y up, looking along -z. Pixel (0, 0) is at the top
/// left; integer coordinates are pixel centres; cx and cy are measured from the image's corner.
struct Camera {
  Pose pose{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};  ///< from the camera to the world
  double fx = 1;                                  ///< horizontal focal length, pixels, > 0
  double fy = 1;                                  ///< vertical focal length, pixels, > 0
  double cx = 0;     ///< principal point, pixels from the left edge: width / 2 when centred
  double cy = 0;     ///< principal point, pixels from the upper edge: height / 2 when centred
  Index width = 0;   ///< pixels
  Index height = 0;  ///< pixels

  /// The last column of the pose.
  Vec3 position() const { return {pose[3], pose[7], pose[11]}; }
  /// The viewing direction: minus the pose's third column; unit if the pose is a rotation.
  Vec3 forward() const { return {-pose[2], -pose[6], -pose[10]}; }
  /// Returns the same view at another resolution. @throws ValueError unless both are at least 1
  Camera scaled(Index new_width, Index new_height) const;
  /// Returns the same view with a longer side of `size` pixels, the other in proportion and at least 1; 0:
  /// unchanged.
  Camera scaled(Index size) const;
  /// Returns pose, fx, fy, cx, cy: the argument of rays().
  std::array<double, 16> parameters() const;
};

/// Makes a centred camera with square pixels.
/// @param angle_x  horizontal field of view, radians, in (0, pi)   @throws ValueError if outside, or if a
/// side is below 1
Camera make_camera(const Pose& pose, double angle_x, Index width, Index height);

/// Returns the pose at `eye` that looks at `target` with `up` upwards in the image. If the viewing direction
/// is along `up`, the coordinate axis farthest from that direction replaces it.
/// @throws ValueError if eye and target coincide or a coordinate is not finite
Pose look_at(const Vec3& eye, const Vec3& target, const Vec3& up);

/// Returns the ray through the centre of pixel (x, y):
///   d = R ((x + 1/2 - cx) / fx, -(y + 1/2 - cy) / fy, -1), normalised.
/// @param x, y  pixels, need not be integers
Ray pixel_ray(const Camera& camera, double x, double y);

/// pixel_ray() for many pixels, in float.
/// @param pixels      [N, 2] x and y in pixels
/// @param origins     [N, 3] written   @param directions  [N, 3] written, unit
/// @throws ValueError  if the size of pixels is odd
void camera_rays(const Camera& camera, std::span<const float> pixels, float* origins, float* directions);

}  // namespace fieldmark::nerf
