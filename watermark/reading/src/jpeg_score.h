#pragma once
#include <fieldmark/engine/tensor.h>

#include <span>
#include <vector>

#include "jpeg_planes.h"

namespace fieldmark::watermark {

/// Likelihood of a small mark on a render, given a compressed image.
struct JpegScore {
  Tensor<float> score;  ///< [H, W, 3] d log P(image | render) / d render
  /// [H, W, 3] inverse variance of the noise that tells as much of the mark: the sum over the components of a
  /// block's expected square of score times mark, divided by the mark's power there.
  Tensor<float> precision;
};

struct QuantisedComponent;

/// A compressed image whose coefficients judge renders and marks. With b the coefficients of a render, q the
/// steps and n q the image's coefficients, which are known exactly where nothing was clipped,
///   P(n | b) = Phi((n + 1/2) q - b) - Phi((n - 1/2) q - b),   Phi of deviation s_band f_block.
/// P has 2% of outliers besides. The deviations of render and image before compression are fitted by maximum
/// likelihood: s_band over all blocks, then f_block.
class JpegImage {
 public:
  /// @param image  [H, W, 3]   @param object  [H W] 1 on the foreground, else 0; other blocks do not count
  /// @throws ShapeError if these do not fit   @throws ValueError if the quality is out of range,
  /// or the first whole block outside the image
  JpegImage(const Tensor<float>& image, std::span<const double> object, const JpegTrace& trace);
  ~JpegImage();
  JpegImage(const JpegImage&) = delete;
  JpegImage& operator=(const JpegImage&) = delete;
  /// Computes log P(image | render) of the blocks on the foreground: of every seventh if that leaves 16 or
  /// more, else of all. The deviations are those that fit these blocks.
  /// @param render  [H, W, 3] in the image's tones   @throws ShapeError if it does not fit
  double log_likelihood(const Tensor<float>& render) const;
  /// Computes the locally optimal score of a mark, d log P / d b, transformed back to pixels. A faint mark
  /// shows only near a decision boundary of the quantiser; elsewhere a plain residual would be noise.
  /// @param render  as above   @param mark  [H, W, 3] change at sign +1   @throws ShapeError if these do not
  /// fit
  JpegScore score(const Tensor<float>& render, const Tensor<float>& mark) const;

 private:
  Shape shape_;
  JpegTrace trace_;
  std::vector<QuantisedComponent> components_;
};

}  // namespace fieldmark::watermark
