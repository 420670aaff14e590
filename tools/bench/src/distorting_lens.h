#pragma once
#include <fieldmark/nerf/analytic_scene.h>

#include <string>

namespace fieldmark::bench {

/// A lens that moves an image point from distance r of its axis to distance d(r), in focal lengths.
/// Independent of the readers' lenses, which it checks.
class DistortingLens {
 public:
  /// d = atan r
  static DistortingLens equidistant();
  /// d = r (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6)
  static DistortingLens rational();
  /// Returns d(r).
  double distorted(double r) const;
  /// Inverts distorted() for d up to 1 by bisection.
  double undistorted(double d) const;
  /// Returns the keys of a transforms.json that name the lens, as a JSON object.
  std::string keys() const;

 private:
  bool fisheye_ = false;
  double k_[6]{};
};

/// Ray-traces a built-in scene through a lens.
/// @param camera  pose, focal length and size   @return [height, width, 4] straight alpha
Tensor<float> distorted_image(const nerf::SceneOptions& options, const nerf::Camera& camera,
                              const DistortingLens& lens);

}  // namespace fieldmark::bench
