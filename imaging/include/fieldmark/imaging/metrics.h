#pragma once
#include <fieldmark/engine/tensor.h>

namespace fieldmark {

/// Computes the mean squared difference of the values as given (not rounded to 8 bits), summed in double.
/// @param a, b  of one shape, not empty   @throws ShapeError otherwise
double mse(const Tensor<float>& a, const Tensor<float>& b);

/// Computes the peak signal-to-noise ratio of whole images, both rounded to 8 bits first, see quantize8().
///   psnr = -10 log10(mean (a - b)^2), in dB; the sum of squares is exact
/// @param a, b  images of one shape in [0, 1], not empty
/// @return infinity if the rounded images are equal
/// @throws ShapeError if the shapes differ or are empty
double psnr(const Tensor<float>& a, const Tensor<float>& b);

/// Computes psnr() over the pixels whose mask exceeds 0.5: the foreground, if the mask is the opacity.
/// @param a, b  [H, W, C]   @param mask  [H, W]
/// @return NaN if the mask is empty   @throws ShapeError
double psnr_masked(const Tensor<float>& a, const Tensor<float>& b, const Tensor<float>& mask);

/// Computes the structural similarity, averaged over channels and window positions inside the image.
///   ssim = (2 ma mb + c1) (2 cov + c2) / ((ma^2 + mb^2 + c1) (va + vb + c2)),   c1 = 0.01^2, c2 = 0.03^2
/// with means, variances and covariance under a Gaussian window of 11 x 11 pixels and deviation 1.5.
/// Source: Wang et al. 2004 (Image quality assessment), section III-B; per channel instead of on grey, as the
/// radiance-field literature reports it. Images are not rounded; the computation is in double.
/// @param a, b  [H, W, C] of one shape in [0, 1], H and W at least 11
/// @return in [-1, 1], 1 for equal images
/// @throws ShapeError
double ssim(const Tensor<float>& a, const Tensor<float>& b);

}  // namespace fieldmark
