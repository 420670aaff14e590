#pragma once
#include <fieldmark/nerf/renderer.h>

#include <span>

namespace fieldmark::watermark {

/// One stage of a coarse-to-fine alignment.
struct AlignmentStage {
  Index size = 64;  ///< longer side, pixels; at most the image's own
  double blur = 1;  ///< standard deviation of the Gaussian on image and render, pixels of this size
  int steps = 8;    ///< at most
  /// Motion that ends the stage, pixels: a smaller one, or one below 1.5 times that if it does not reduce the
  /// cost. Steps shorten long before the end, so a stage that must be exact wants a tenth of its error.
  double still = 0.2;
  bool lens = true;        ///< true if the position moves besides focal length and principal point
  bool stretched = false;  ///< true if the aspect of pixels is free, too
  bool quick = false;      ///< true if ray steps are twice as long, which suffices for coarse stages
  double least = -1;       ///< agreement below which the alignment ends with this stage
};

/// A camera and the agreement of its view of the field with an image.
struct Alignment {
  nerf::Camera camera;  ///< of the image's size
  /// Correlation of the gradients of the image and of the last stage's last render, in the image's colours,
  /// on the foreground, in [-1, 1]: 1 if they differ by a change of colour alone. The motion that
  /// ends the stage comes after it.
  double agreement = -1;
  double shown = 0;  ///< share of that render's pixels that show the field
};

/// True if an alignment at 200 pixels may leave the camera inexact: the object is thin, on less than 12% of
/// the pixels, and the agreement is 0.85 to 0.997. docs/notes/reading.md has the measurements.
bool is_inexact(const Alignment& alignment);

/// Refines a camera until the field's render agrees with an image.
///
/// Each step renders the field, fits the image's colours (see tone_fit.h), and solves for the motion that
/// reduces the residual (Lucas and Kanade 1981 with the field's depth; Levenberg-Marquardt damping; Cauchy
/// weights). Motions are 1.5 Gauss-Newton steps, because reweighting makes single steps fall short; after a
/// failed step they are one. The last one is a single step, without rendering again. A rolled
/// camera, another focal length or another principal point explains a rotated, scaled or cropped image. Where
/// the scene fills its images, the plain corners that a rotation leaves are ignored (see plain_border.h).
/// Keeps buffers: use one object per thread. Results do not depend on the number of threads.
class PoseAligner {
 public:
  /// @param field  must outlive this object and not change
  explicit PoseAligner(const nerf::RadianceField& field);
  /// @param image  [H, W, 3], sides of at least 16   @param start  first guess, of any size
  /// @param covered  [H W] 1 where something covers the view, or empty
  /// @return the best camera; agreement -1 if it does not show the field
  /// @throws ShapeError for another rank   @throws ValueError without stages or for a size below 16
  Alignment align(const Tensor<float>& image, const nerf::Camera& start,
                  std::span<const AlignmentStage> stages, const std::vector<std::uint8_t>& covered = {});

 private:
  const nerf::RadianceField& field_;
  nerf::Renderer renderer_, quick_;
};

}  // namespace fieldmark::watermark
