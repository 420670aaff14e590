#pragma once
#include <fieldmark/engine/tensor.h>

#include <array>
#include <vector>

namespace fieldmark::watermark {

/// A rectangle of pixels.
struct PixelBox {
  Index x = 0;       ///< left column
  Index y = 0;       ///< upper row
  Index width = 0;   ///< columns
  Index height = 0;  ///< rows
  /// Pixels in it.
  Index area() const { return width * height; }
  /// True if all sides agree.
  bool operator==(const PixelBox&) const = default;
};

/// A part of an image that plain gaps separate from the rest, and the parts into which gaps divide it.
struct ImageBlock {
  PixelBox box{};                      ///< smallest box around all pixels that differ from the background
  std::vector<ImageBlock> parts = {};  ///< from top to bottom or from left to right; none, or at least two
};

/// The blocks of an image, and its background.
struct ImageBlocks {
  ImageBlock all{};                   ///< the block of all blocks
  std::array<float, 3> background{};  ///< colour of the gaps; black if the image has none
};

/// Divides an image by its plain gaps: the recursive XY cut. The background is the colour of most pixels.
/// Gaps are rows, or else columns, of nothing but background (within 0.1 in every channel) from edge to edge
/// of a block, at least a hundredth of the image's shorter side wide and at least 4 pixels. An image in which
/// no colour takes a tenth of the pixels has one block, itself. Source: Nagy and Seth, "Hierarchical
/// representation of optically scanned documents", ICPR 1984.
/// @param rgb  [H, W, 3] in [0, 1]   @param least  parts with a shorter side are left out, pixels, at least 1
/// @return ImageBlocks::all has an empty box if nothing differs from the background
/// @throws ShapeError if rgb is not [H, W, 3]   @throws ValueError if least is below 1
ImageBlocks image_blocks(const Tensor<float>& rgb, Index least);

}  // namespace fieldmark::watermark
