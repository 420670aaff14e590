#pragma once
// The components of a JPEG image and their blocks. Private.
#include <fieldmark/distort/jpeg_blocks.h>
#include <fieldmark/engine/tensor.h>

#include <span>
#include <vector>

namespace fieldmark::watermark {

constexpr Index kJpegSide = 8;  // values of a block

/// JPEG compression of an image.
struct JpegTrace {
  int quality = 0;          ///< of libjpeg's scale, 1 to 100
  bool subsampled = false;  ///< chroma at half size (4:2:0)
  Index left = 0, top = 0;  ///< pixels before the first whole block, if bars were cut off
};

/// One component of an image, in levels; chroma may have half the size.
struct JpegPlane {
  Index height = 0, width = 0;
  std::vector<double> level;  ///< [height width] 0 to 255, chroma around 0
};

/// Returns the rows and columns from the first whole block on; no rows or columns if there is none.
/// @param x  [H, W, 3]
Tensor<float> from_first_block(const Tensor<float>& x, const JpegTrace& trace);

/// Computes a component: means over cells.
/// @param image  [H, W, 3] in [0, 1]   @param component  0 luma, 1 and 2 chroma   @param cell  pixels of a
/// value's side, 1 or 2
JpegPlane component_of(const Tensor<float>& image, int component, Index cell);

/// As component_of(), from an image whose decoder made chroma smoother as it doubled its size.
JpegPlane decoded_component(const Tensor<float>& image, int component, Index cell);

/// Computes the coefficients of the blocks; repeats the last row and column to fill blocks.
/// @param middle  level that is subtracted   @param used  [blocks] above 0 for the blocks to compute; all if
/// empty
std::vector<distort::JpegBlock> jpeg_coefficients(const JpegPlane& p, double middle,
                                                  std::span<const double> used = {});

}  // namespace fieldmark::watermark
