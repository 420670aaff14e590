#pragma once
#include <fieldmark/engine/tensor.h>

#include <span>
#include <vector>

namespace fieldmark::watermark {

/// Sums over rectangles of an image in constant time (Crow 1984):
///   S(x, y) = sum of the pixels above and left of (x, y), between whole numbers by bilinear interpolation,
/// which is the exact integral of an image of square pixels.
class SummedArea {
 public:
  SummedArea() = default;
  /// @param image  [H, W, C], at least one pixel   @throws ShapeError if it is none
  explicit SummedArea(const Tensor<float>& image);
  Index height() const { return height_; }  ///< pixels
  Index width() const { return width_; }    ///< pixels
  /// Means over the n x n parts of a rectangle, row by row, [n, n, C].
  /// @param left, top, wide, high  pixels, within the image; wide and high above 0   @param n  at least 1
  /// @param out  n n C numbers   @throws ValueError if the rectangle is not in the image or out does not
  /// fit
  void means(double left, double top, double wide, double high, Index n, std::span<float> out) const;

 private:
  Index height_ = 0, width_ = 0, channels_ = 0;
  std::vector<double> sum_;  // [H + 1, W + 1, C]
};

}  // namespace fieldmark::watermark
