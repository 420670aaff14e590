#pragma once
#include <fieldmark/engine/tensor.h>

#include <optional>
#include <span>

namespace fieldmark::watermark {

/// JPEG compression of an image.
struct JpegTrace {
  int quality = 0;          ///< of libjpeg's scale, 1 to 100
  bool subsampled = false;  ///< chroma at half size (4:2:0)
  Index left = 0, top = 0;  ///< pixels before the first whole block, if bars were cut off
};

/// Detects JPEG compression: under the correct quantisation table, the coefficients of 8 x 8 blocks are
/// multiples of the steps (Fan and de Queiroz 2003). Blocks with a value of 0 or 1 do not count, because a
/// decoder clips there. Fails if the image was resized afterwards, or shifted by other numbers of pixels.
/// @param image  [H, W, 3] in [0, 1], in steps of 1/255   @param left, top  pixels that were cut off, >= 0
/// @return nothing if no table fits
std::optional<JpegTrace> find_jpeg(const Tensor<float>& image, Index left = 0, Index top = 0);

/// Computes log P(image | render) of the blocks on the foreground, see jpeg_score(): of every seventh if that
/// leaves 16 or more, else of all. The deviations are those that fit these blocks.
/// @param image, render, object  as of jpeg_score()
/// @throws ShapeError, ValueError as jpeg_score()
double jpeg_log_likelihood(const Tensor<float>& image, const Tensor<float>& render,
                           std::span<const double> object, const JpegTrace& trace);

/// Likelihood of a small mark on a render, given a compressed image.
struct JpegScore {
  Tensor<float> score;  ///< [H, W, 3] d log P(image | render) / d render
  /// [H, W, 3] inverse variance of the noise that tells as much of the mark: the sum over the components of a
  /// block's expected square of score times mark, divided by the mark's power there.
  Tensor<float> precision;
};

/// Computes the locally optimal score of a mark under quantisation. With b the coefficients of the render, q
/// the steps and n q the image's coefficients, which are known exactly where nothing was clipped,
///   P(n | b) = Phi((n + 1/2) q - b) - Phi((n - 1/2) q - b),   Phi of deviation s_band f_block,
/// and the score is d log P / d b, transformed back to pixels. A faint mark shows only near a decision
/// boundary of the quantiser; elsewhere a plain residual would be noise. The deviations of render and image
/// before compression are maximum-likelihood estimates.
/// @param render  [H, W, 3] in the image's tones   @param mark  [H, W, 3] change at sign +1
/// @param object  [H W] 1 on the foreground, else 0   @throws ShapeError if these do not fit
/// @throws ValueError if the quality is out of range
JpegScore jpeg_score(const Tensor<float>& image, const Tensor<float>& render, const Tensor<float>& mark,
                     std::span<const double> object, const JpegTrace& trace);

}  // namespace fieldmark::watermark
