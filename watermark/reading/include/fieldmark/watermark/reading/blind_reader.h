#pragma once
#include <fieldmark/watermark/evidence/evidence.h>
#include <fieldmark/watermark/mark/object_window.h>
#include <fieldmark/watermark/mark/owner.h>

namespace fieldmark::watermark {

/// Converts any 8-bit image to what the readers take: repeats grey and composites alpha over the background.
/// @param image  [H, W, 1 to 4], sides of at least 16   @return [H, W, 3]
/// @throws ShapeError if it is not an image or is too small   @throws ValueError if a value is not finite
Tensor<float> opaque_image(const Tensor<float>& image, float background);

/// Checks that all values of an image are finite.
/// @param op  for the message   @param image  [H, W, C]   @throws ValueError naming row and column of the
/// first that is not
void check_finite(const char* op, const Tensor<float>& image);

/// Blind detection: the extractor looks at an image and knows neither key nor message nor camera. Calls may
/// run at the same time.
class BlindReader {
 public:
  /// @param owner  must outlive the reader
  explicit BlindReader(const Owner& owner) : owner_(owner) {}
  /// Computes the detector reading S_c of every cell (without cells, the logit of every slot), see
  /// evidence.h. First cuts out the object's window and resamples it to the extractor's size (see
  /// object_window.h).
  /// @param image  [H, W, 1 to 4], sides of at least 16; grey is repeated, alpha is composited over the
  /// field's background
  /// @return [cells]   @throws ShapeError, ValueError as opaque_image()
  std::vector<double> evidence(const Tensor<float>& image) const;
  /// Overload that also tells where the extractor sees which cell.   @param places  written unless null
  std::vector<double> evidence(const Tensor<float>& image, SeenPlaces* places) const;

 private:
  const Owner& owner_;
};

}  // namespace fieldmark::watermark
