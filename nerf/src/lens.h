#pragma once
#include <fieldmark/engine/tensor.h>
#include <fieldmark/nerf/camera.h>

#include <optional>
#include <string>

namespace fieldmark::nerf {

/// A point of the plane at distance 1 before the camera: x right, y down, in tangents of angles.
using Vec2 = std::array<double, 2>;

/// Radial and tangential distortion of a lens, from where a pinhole would see a point to where it is seen:
///   x' = x (1 + k1 r^2 + k2 r^4) + 2 p1 x y + p2 (r^2 + 2 x^2)
///   y' = y (1 + k1 r^2 + k2 r^4) + p1 (r^2 + 2 y^2) + 2 p2 x y,   r^2 = x^2 + y^2
/// Source: Brown 1966, in the signs and order of OpenCV, COLMAP and instant-ngp.
struct Lens {
  double k1 = 0;  ///< radial, of r^2
  double k2 = 0;  ///< radial, of r^4
  double p1 = 0;  ///< tangential
  double p2 = 0;  ///< tangential

  bool operator==(const Lens&) const = default;  ///< equal in every coefficient
  /// Whether it leaves every point where it is.
  bool is_pinhole() const { return k1 == 0 && k2 == 0 && p1 == 0 && p2 == 0; }
  /// "k1 0.1 k2 0 p1 0 p2 0"
  std::string text() const;
  /// Where a pinhole's point is seen.
  Vec2 distorted(const Vec2& point) const;
  /// The pinhole's point that is seen there, by Newton's method with halved steps; none if it does not
  /// converge to 1e-12 in 100 steps or the map folds over between the axis and the point found.
  std::optional<Vec2> undistorted(const Vec2& seen) const;
  /// Whether the map's derivative, a symmetric matrix, is positive definite at 32 places on the line from the
  /// axis to a pinhole's point: then the map has not folded over on the way.
  bool is_regular(const Vec2& point) const;
};

/// Part of an image, pixels.
struct Crop {
  Index left = 0;                                ///< columns cut off at the left
  Index top = 0;                                 ///< rows cut off at the top
  Index width = 0;                               ///< columns kept
  Index height = 0;                              ///< rows kept
  bool operator==(const Crop&) const = default;  ///< equal in all four
};

/// The part of a pinhole's image that a lens's image of the same size and intrinsics covers: the largest
/// rectangle found by taking away, side by side, the row or column with the greatest share of pixels without
/// a source. What the lens saw beyond the pinhole's image is given up too.
/// @throws ValueError  if the distortion cannot be inverted at one of 33 x 33 places spread over the lens's
///                     image, corners included, or no pixel is left
Crop covered_part(const Camera& camera, const Lens& lens);

/// The camera of a part of its image. @throws ValueError unless the part is within the image
Camera cropped(const Camera& camera, const Crop& part);

/// A lens's image as a pinhole of the same intrinsics sees it: the pinhole's pixel is read where the lens
/// put it, linearly between the four pixels around, colour weighed by alpha, the border pixel in the
/// outermost half pixel. Costs the sharpness of one linear interpolation.
/// @param rgba  [H, W, 4] of the camera's size   @param part  what to make, see covered_part()
/// @return [part.height, part.width, 4]   @throws ShapeError if sizes differ
Tensor<float> undistorted_image(const Tensor<float>& rgba, const Camera& camera, const Lens& lens,
                                const Crop& part);

}  // namespace fieldmark::nerf
