#pragma once
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/params.h>
#include <fieldmark/nerf/camera.h>
#include <fieldmark/nerf/space.h>

#include <optional>
#include <span>
#include <vector>

namespace fieldmark::nerf {

/// Options of ImageCorrections: what it learns.
struct ImageCorrectionOptions {
  Index images = 0;     ///< V
  bool colour = false;  ///< a colour_affine() for each image
  bool pose = false;    ///< a small motion for each image's camera
  double length = 1;    ///< unit of the cameras' shifts, in world length, > 0
};

/// What training learns about each image in addition to the field: exposure and white balance, and the place
/// of its camera. All parameters start at 0, which changes nothing.
class ImageCorrections {
 public:
  explicit ImageCorrections(const ImageCorrectionOptions& options);

  /// "colour" [V, 12], see colour_affine(), and "pose" [V, 6]: rotation vector w and shift s of a camera
  /// about its own position, R' = exp(w) R and c' = c + length s.
  ParamStore<float> params;
  /// Corrects the colours of rays of the given images and adds gradients to `grads`, laid out as params.
  /// Without colour, returns them unchanged.
  Var<float> coloured(Var<float> rays, std::span<const Index> image, float* grads) const;
  /// True if cameras move.
  bool moves() const { return pose_.has_value(); }
  /// Returns the corrected camera of an image; unchanged without pose.
  Camera moved(const Camera& camera, Index image) const;
  /// Adds the gradient of a camera's motion: samples move with their camera, and w and s with
  ///   dL/ds = length sum_i h_i,   dL/dw = J(w)^T sum_i (P_i - c') x h_i,   h_i = dL/dP_i
  /// where J is the left Jacobian of the rotations.
  /// @param x, dx   [n, 3] samples of the image's rays in the unit cube, and dL/dx
  /// @param camera  moved()   @param grads  laid out as params
  void add_motion(Index image, const Camera& camera, const Space& space, std::span<const float> x,
                  std::span<const float> dx, float* grads) const;
  /// Subtracts the mean over images from every parameter, so that the field keeps the mean exposure and the
  /// overall place of the cameras.
  void hold_means();
  /// Returns step sizes and decay for Adam.
  std::vector<AdamRange> ranges() const;

 private:
  ImageCorrectionOptions options_;
  std::optional<ParamId> colour_, pose_;
};

}  // namespace fieldmark::nerf
