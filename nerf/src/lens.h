#pragma once
#include <fieldmark/engine/tensor.h>
#include <fieldmark/nerf/dataset.h>

#include <optional>
#include <string>

namespace fieldmark::nerf {

/// A point of the plane at distance 1 in front of the camera: x right, y down, in tangents of angles.
using Vec2 = std::array<double, 2>;

/// Distortion models of Lens.
enum class LensModel {
  polynomial,  ///< a = 1 + k1 r^2 + k2 r^4 + k3 r^6 + k4 r^8 (nerfstudio, Metashape)
  rational,    ///< a = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6) (FULL_OPENCV)
  fisheye      ///< a = t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8) / r, t = atan r (OPENCV_FISHEYE)
};

/// Radial and tangential distortion of a lens. Maps a pinhole's image of a point to the lens's:
///   x' = x a + 2 p1 x y + p2 (r^2 + 2 x^2)
///   y' = y a + p1 (r^2 + 2 y^2) + 2 p2 x y,   r^2 = x^2 + y^2, and a by LensModel
/// Source: Brown 1966 and Kannala and Brandt 2006 (fisheye), in the signs and order of OpenCV, COLMAP and
/// instant-ngp.
struct Lens {
  double k1 = 0;                            ///< radial
  double k2 = 0;                            ///< radial
  double p1 = 0;                            ///< tangential; not of a fisheye
  double p2 = 0;                            ///< tangential; not of a fisheye
  double k3 = 0;                            ///< radial
  double k4 = 0;                            ///< radial
  double k5 = 0;                            ///< of the rational model alone
  double k6 = 0;                            ///< of the rational model alone
  LensModel model = LensModel::polynomial;  ///< formula of a

  bool operator==(const Lens&) const = default;  ///< equal in every coefficient
  /// True if the lens leaves every point unchanged: all coefficients are 0 and it is not a fisheye.
  bool is_pinhole() const { return *this == Lens{.model = model} && model != LensModel::fisheye; }
  /// Returns "k1 0.1 k2 0 p1 0 p2 0", followed by further coefficients that are not 0; "fisheye" comes first.
  std::string text() const;
  /// Maps a pinhole's point to the lens's image.
  Vec2 distorted(const Vec2& point) const;
  /// Inverts distorted() by Newton's method with halved steps; none if it does not converge to 1e-12 in 100
  /// steps or the map folds over between the axis and the point found.
  std::optional<Vec2> undistorted(const Vec2& seen) const;
  /// Returns true if the map's derivative, a symmetric matrix, is positive definite at 32 places on the line
  /// from the axis to a pinhole's point, so that the map does not fold over on the way.
  bool is_regular(const Vec2& point) const;
};

/// The intrinsics that a file states for a camera; the rest follows from the image.
struct Intrinsics {
  double angle_x = 0;          ///< horizontal field of view, radians, in (0, pi); 0: not stated
  double angle_y = 0;          ///< vertical field of view, radians, in (0, pi); 0: not stated
  double fl_x = 0;             ///< horizontal focal length, pixels, wins over angle_x; 0: not stated
  double fl_y = 0;             ///< vertical focal length, pixels, wins over angle_y; 0: as fl_x
  std::optional<double> cx{};  ///< principal point from the left edge, pixels; none: the middle
  std::optional<double> cy{};  ///< principal point from the upper edge, pixels; none: the middle
  Index width = 0;             ///< pixels of the image that these hold for; 0: any
  Index height = 0;            ///< pixels of the image that these hold for; 0: any
  Lens lens{};                 ///< distortion, the same at every size

  /// Returns the pinhole camera for an image of this size, with lengths in pixels scaled from the stated
  /// size.
  /// @throws ValueError  if neither fl_x nor angle_x is stated, or the image is not a scaled version of the
  /// stated size (each side to within a pixel)
  Camera camera(const Pose& pose, Index image_width, Index image_height) const;
};

/// Part of an image, pixels.
struct Crop {
  Index left = 0;                                ///< columns removed at the left
  Index top = 0;                                 ///< rows removed at the top
  Index width = 0;                               ///< columns kept
  Index height = 0;                              ///< rows kept
  bool operator==(const Crop&) const = default;  ///< equal in all four
};

/// Finds the part of a pinhole's image that a lens's image of the same size and intrinsics covers: removes,
/// one at a time, the outermost row or column with the greatest share of pixels without a source.
/// @throws ValueError  if the distortion cannot be inverted at one of 33 x 33 places spread over the lens's
///                     image, corners included (of a fisheye, which may see more than any pinhole: of the
///                     part), to 1e-6 pixels, or no pixel is left
Crop covered_part(const Camera& camera, const Lens& lens);

/// Returns the camera of a part of an image. @throws ValueError unless the part is within the image
Camera cropped(const Camera& camera, const Crop& part);

/// Resamples a lens's image to that of a pinhole of the same intrinsics: bilinear on premultiplied colour,
/// with the border pixel repeated.
/// @param rgba  [H, W, 4] of the camera's size   @param part  of the result, see covered_part()
/// @return [part.height, part.width, 4]   @throws ShapeError if sizes differ
Tensor<float> undistorted_image(const Tensor<float>& rgba, const Camera& camera, const Lens& lens,
                                const Crop& part);

/// For each of a pinhole's pixels, the nearest pixel of a lens's image.
struct NearestPixels {
  /// [height * width of the pinhole] row * width + column in the lens's image; -1 where the centre of that
  /// pixel has no undistorted place
  std::vector<std::int32_t> pixels{};
  /// Displacement from each pinhole pixel's centre to the undistorted centre of the lens's pixel, in pixels
  /// of the pinhole.
  std::shared_ptr<const PixelOffsets> offsets{};
};

/// Finds the nearest pixels. Points outside the lens's image take the nearest border pixel.
/// @param seen  camera of the lens's image   @param pinhole  of the same pose, see covered_part()
NearestPixels nearest_pixels(const Camera& seen, const Lens& lens, const Camera& pinhole);

}  // namespace fieldmark::nerf
