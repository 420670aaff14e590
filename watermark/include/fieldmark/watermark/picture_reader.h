#pragma once
#include <fieldmark/watermark/evidence.h>
#include <fieldmark/watermark/owner.h>

namespace fieldmark::watermark {

/// The blind reading: the extractor looks at a picture, knowing neither key nor message nor camera.
/// The owner must outlive it. Calls may run at the same time.
class PictureReader {
 public:
  /// @param owner  must outlive the reader
  explicit PictureReader(const Owner& owner) : owner_(owner) {}
  /// Sign evidence S_c of every cell (for preset paper the logit of every slot), see evidence.h. The object's
  /// window is cut out and brought to the reader's size first (see object_window.h).
  /// @param picture  [H, W, 1 to 4]; grey is repeated, alpha is laid over the field's background; sides of at
  /// least 16
  /// @return [cells]   @throws ShapeError if it is no picture or too small
  std::vector<double> evidence(const Tensor<float>& picture) const;

 private:
  const Owner& owner_;
};

}  // namespace fieldmark::watermark
