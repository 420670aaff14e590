#pragma once
#include <fieldmark/imaging/lpips.h>
#include <fieldmark/nerf/renderer.h>

#include <functional>
#include <vector>

namespace fieldmark::nerf {

/// Metrics of one render against ground truth.
struct ViewScore {
  double psnr;                ///< over the whole image, dB
  double psnr_foreground;     ///< over the foreground, dB; NaN if it is empty
  double psnr_colour_fitted;  ///< over the whole image, of colour_fitted(), dB
  double ssim;                ///< in [-1, 1]; NaN for an image smaller than the window of ssim()
  double lpips;               ///< of both rounded to 8 bits; NaN without a network or for an image too small
};

/// Means over the views of a data set; each skips the views where its metric is NaN.
struct Evaluation {
  double psnr = 0;                  ///< mean of ViewScore::psnr
  double psnr_foreground = 0;       ///< mean of ViewScore::psnr_foreground
  double psnr_colour_fitted = 0;    ///< mean of ViewScore::psnr_colour_fitted
  double ssim = 0;                  ///< mean of ViewScore::ssim
  double lpips = 0;                 ///< mean of ViewScore::lpips
  Index views = 0;                  ///< rendered
  double seconds_per_view = 0;      ///< of rendering alone
  std::vector<ViewScore> per_view;  ///< [views] in the order of the data set
};

/// Renders every view of a data set and compares it with the ground truth, both over the data set's
/// background. The foreground consists of the pixels whose alpha exceeds 0.5 in the ground truth, or in the
/// render if the ground truth is opaque. No PSNR counts invalid pixels (View::valid); SSIM and LPIPS, which
/// need whole images, see them as black in both.
/// @param progress  called after each render; returns false to stop with the views so far. May be empty
/// @param lpips     the network of ViewScore::lpips, or null
/// @throws ValueError if there are no views
Evaluation evaluate(Renderer& renderer, const Dataset& dataset,
                    const std::function<bool(Index done, Index total)>& progress = {},
                    const Lpips<float>* lpips = nullptr);

}  // namespace fieldmark::nerf
