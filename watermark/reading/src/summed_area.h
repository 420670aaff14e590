#pragma once
#include <fieldmark/engine/tensor.h>

#include <span>
#include <vector>

namespace fieldmark::watermark {

/// Summed-area table (Crow 1984): means over rectangles of an image in constant time.
///   S(x, y) = sum of the pixels above and left of (x, y), bilinear between grid points: the exact integral
///   of square pixels
class SummedArea {
 public:
  SummedArea() = default;
  /// @param image  [H, W, C], at least one pixel   @throws ShapeError if it is none
  explicit SummedArea(const Tensor<float>& image);
  Index height() const { return height_; }  ///< pixels
  Index width() const { return width_; }    ///< pixels
  /// Computes means over the n x n parts of a rectangle.
  /// @param left, top, wide, high  pixels, within the image; wide and high above 0   @param n  at least 1
  /// @param out  [n, n, C]   @throws ValueError if the rectangle leaves the image or out has another size
  void means(double left, double top, double wide, double high, Index n, std::span<float> out) const;

 private:
  Index height_ = 0, width_ = 0, channels_ = 0;
  std::vector<double> sum_;  // [H + 1, W + 1, C]
};

}  // namespace fieldmark::watermark
