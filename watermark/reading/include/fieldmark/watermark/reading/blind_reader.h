#pragma once
#include <fieldmark/watermark/evidence/evidence.h>
#include <fieldmark/watermark/mark/object_window.h>
#include <fieldmark/watermark/mark/owner.h>

namespace fieldmark::watermark {

/// Any 8-bit image as the readers take it: grey is repeated, alpha is laid over the background.
/// @param image  [H, W, 1 to 4], sides of at least 16   @return [H, W, 3]
/// @throws ShapeError if it is no image or too small
Tensor<float> opaque_image(const Tensor<float>& image, float background);

/// The blind detection: the extractor looks at an image, knowing neither key nor message nor camera.
/// The owner must outlive it. Calls may run at the same time.
class BlindReader {
 public:
  /// @param owner  must outlive the reader
  explicit BlindReader(const Owner& owner) : owner_(owner) {}
  /// Sign evidence S_c of every cell (without cells the logit of every slot), see evidence.h. The object's
  /// window is cut out and brought to the reader's size first (see object_window.h).
  /// @param image  [H, W, 1 to 4]; grey is repeated, alpha is laid over the field's background; sides of at
  /// least 16
  /// @return [cells]   @throws ShapeError if it is no image or too small
  std::vector<double> evidence(const Tensor<float>& image) const;
  /// The same, and where the extractor sees which cell.   @param places  written unless null
  std::vector<double> evidence(const Tensor<float>& image, SeenPlaces* places) const;

 private:
  const Owner& owner_;
};

}  // namespace fieldmark::watermark
