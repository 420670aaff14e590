#pragma once
#include <fieldmark/nerf/renderer.h>

#include <span>

namespace fieldmark::watermark {

/// One stage of an alignment: steps at one size of the image.
struct AlignmentStage {
  Index size = 64;  ///< of the longer side, pixels; never above the image's own
  double blur = 1;  ///< deviation of the Gaussian laid over image and render, pixels of this size
  int steps = 8;    ///< at most; a stage ends earlier where nothing moves any more
  bool lens =
      true;  ///< whether the focal length moves apart from the distance, and the cut apart from the aim
  bool quick = false;  ///< whether steps along the rays are twice as long: a camera that later stages mend
};

/// A camera and how well its view of the field agrees with an image.
struct Alignment {
  nerf::Camera camera;  ///< of the image's size
  /// Correlation of the brightness slopes of image and render on what the field shows, in [-1, 1]: 1 where
  /// they are alike but for gain and offset. Of the last stage.
  double agreement = -1;
};

/// Moves cameras until a field's view agrees with an image.
///
/// Each step renders the field, fits gain, offset and gamma of each channel, and solves for the motion that
/// the remaining difference asks for (Lucas and Kanade 1981 with the field's own depth; Levenberg and
/// Marquardt's damping; Cauchy weights). An image that was rotated, scaled or cut is seen by a camera that
/// was rolled, or has another focal length or principal point, so that it needs nothing of its own; the plain
/// corners that turning leaves (see plain_border.h) do not count where the field's scene fills its images.
/// Keeps buffers: one object per thread. Equal arguments give equal bits for any number of threads.
class PoseAligner {
 public:
  /// @param field  must outlive this and not change
  explicit PoseAligner(const nerf::RadianceField& field);
  /// @param image  [H, W, 3], sides of at least 16   @param start  any size; its view is that of the
  /// image
  /// @return the best camera met; agreement -1 where the field shows nothing in it
  /// @throws ShapeError if the image is none   @throws ValueError if there is no stage or one's size is
  /// below 16
  Alignment align(const Tensor<float>& image, const nerf::Camera& start,
                  std::span<const AlignmentStage> stages);

 private:
  const nerf::RadianceField& field_;
  nerf::Renderer renderer_, quick_;
};

}  // namespace fieldmark::watermark
