#pragma once
#include <fieldmark/engine/tensor.h>

#include <array>
#include <string_view>

namespace fieldmark {

/// A point on a canvas, in pixels from its upper left corner; pixel centres are at n + 1/2.
struct CanvasPoint {
  double x = 0;  ///< to the right
  double y = 0;  ///< downwards
};

/// An image to draw on, initially white. Edges are antialiased: a shape covers a pixel by 1/2 minus the
/// distance of the pixel's centre from the shape, in pixels, clamped to [0, 1]. Shapes may extend beyond the
/// canvas.
class Canvas {
 public:
  /// Red, green and blue in [0, 1].
  using Ink = std::array<float, 3>;

  /// @param height, width  pixels   @throws ValueError unless both are 1 to 16384
  Canvas(Index height, Index width);
  /// Draws a line with round ends, or a disc at length zero. Draws nothing if a coordinate is not finite.
  /// @param thickness  pixels, > 0
  void line(const CanvasPoint& from, const CanvasPoint& to, double thickness, const Ink& ink);
  /// Draws a line of text. Characters outside ASCII become question marks.
  /// @param corner  its upper left, rounded to pixels   @param scale  pixels of a stroke, >= 1; capitals are
  /// seven strokes high
  void text(const CanvasPoint& corner, std::string_view text, int scale, const Ink& ink);
  /// Returns the width of a text in pixels.
  static Index text_width(std::string_view text, int scale);
  /// Returns the image [height, width, 3].
  const Tensor<float>& image() const { return image_; }

 private:
  void cover(Index x, Index y, double share, const Ink& ink);
  Tensor<float> image_;
};

}  // namespace fieldmark
