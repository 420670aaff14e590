#pragma once
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/params.h>
#include <fieldmark/nerf/camera.h>
#include <fieldmark/nerf/space.h>

#include <optional>
#include <span>
#include <vector>

namespace fieldmark::nerf {

/// What ImageCorrections learns.
struct ImageCorrectionOptions {
  Index images = 0;     ///< V
  bool colour = false;  ///< a colour_affine() of each image
  bool pose = false;    ///< a small motion of each image's camera
  double length = 1;    ///< unit of the cameras' shifts, in the world's length, > 0
};

/// What a training learns of each of its images beside the field: exposure and white balance, and where its
/// camera stood. All start at 0, which changes nothing.
class ImageCorrections {
 public:
  explicit ImageCorrections(const ImageCorrectionOptions& options);

  /// "colour" [V, 12], see colour_affine(), and "pose" [V, 6]: rotation vector w and shift s of a camera
  /// about its own position, R' = exp(w) R and c' = c + length s.
  ParamStore<float> params;
  /// Colours of rays of given images, with gradients added to `grads`, laid out as params; as they came
  /// without colour.
  Var<float> coloured(Var<float> rays, std::span<const Index> image, float* grads) const;
  /// Whether cameras move.
  bool moves() const { return pose_.has_value(); }
  /// The corrected camera of an image; the same without pose.
  Camera moved(const Camera& camera, Index image) const;
  /// Adds the gradient of a camera's motion: samples move with their camera, and w and s with
  ///   dL/ds = length sum_i h_i,   dL/dw = J(w)^T sum_i (P_i - c') x h_i,   h_i = dL/dP_i
  /// where J is the left Jacobian of the rotations.
  /// @param x, dx   [n, 3] samples of the image's rays in the unit cube, and dL/dx
  /// @param camera  moved()   @param grads  laid out as params
  void add_motion(Index image, const Camera& camera, const Space& space, std::span<const float> x,
                  std::span<const float> dx, float* grads) const;
  /// Takes the mean over images out of every parameter, so that the field keeps the mean exposure and the
  /// place of the cameras as a whole.
  void hold_means();
  /// Step sizes and decay for Adam.
  std::vector<AdamRange> ranges() const;

 private:
  ImageCorrectionOptions options_;
  std::optional<ParamId> colour_, pose_;
};

}  // namespace fieldmark::nerf
