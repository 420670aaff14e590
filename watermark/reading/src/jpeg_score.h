#pragma once
#include <fieldmark/engine/tensor.h>

#include <optional>
#include <span>

namespace fieldmark::watermark {

/// How an image was last compressed.
struct JpegTrace {
  int quality = 0;          ///< of libjpeg's scale, 1 to 100
  bool subsampled = false;  ///< chroma at half size (4:2:0)
};

/// The compression that an image's numbers show: under the right table of steps, coefficients of its 8 x 8
/// blocks lie at whole multiples (Fan and de Queiroz 2003). Sees it only where the image was neither moved
/// nor resized since.
/// @param image  [H, W, 3] in [0, 1], in steps of 1/255   @return none where no table fits
std::optional<JpegTrace> find_jpeg(const Tensor<float>& image);

/// What a compressed image says of a small mark on a render.
struct JpegScore {
  Tensor<float> score;  ///< [H, W, 3] d log P(image | render) / d render
  /// [H, W, 3] expectation of the square of score times mark, of each block spread over its pixels.
  Tensor<float> information;
  double log_likelihood = 0;  ///< log P(image | render), of blocks on the object
};

/// The locally best test of a mark under quantisation. With b the coefficients of the render, q the steps and
/// n q the image's coefficients, which are known exactly,
///   P(n | b) = Phi((n + 1/2) q - b) - Phi((n - 1/2) q - b),   Phi of deviation s_band f_block,
/// and the score is d log P / d b, carried back to the pixels' colours: near a boundary between two steps
/// even a faint mark shows, and far from one nothing does, where a plain difference would be noise.
/// Deviations (what a render and the image differ by before compression) are those that make the image
/// likeliest.
/// @param render  [H, W, 3] in the image's tones   @param mark  [H, W, 3] what sign +1 adds
/// @param object  [H W] 1 where the field is seen, else 0   @throws ShapeError if these do not fit
JpegScore jpeg_score(const Tensor<float>& image, const Tensor<float>& render, const Tensor<float>& mark,
                     std::span<const double> object, const JpegTrace& trace);

}  // namespace fieldmark::watermark
