#pragma once
#include <fieldmark/imaging/lpips.h>
#include <fieldmark/nerf/renderer.h>

#include <functional>
#include <vector>

namespace fieldmark::nerf {

/// How close one rendering is to its photograph, see psnr(), psnr_masked() and ssim().
struct ViewScore {
  double psnr;             ///< over the whole image, dB
  double psnr_foreground;  ///< over the object's pixels, dB; NaN where the object is not in the image
  double ssim;             ///< in [-1, 1]; NaN for an image smaller than the window of ssim()
  double lpips;  ///< both rounded to 8 bits; NaN without a network, or for an image it is too small for
};

/// Means over the views of a data set. A view whose number is NaN is left out of that number's mean.
struct Evaluation {
  double psnr = 0;                  ///< mean of ViewScore::psnr
  double psnr_foreground = 0;       ///< mean of ViewScore::psnr_foreground
  double ssim = 0;                  ///< mean of ViewScore::ssim
  double lpips = 0;                 ///< mean of ViewScore::lpips
  Index views = 0;                  ///< rendered
  double seconds_per_view = 0;      ///< of rendering alone
  std::vector<ViewScore> per_view;  ///< [views] in the order of the data set
};

/// Renders every view of a data set and compares it with the photograph in front of the data set's
/// background. The object is where the photograph's alpha exceeds 0.5; where a photograph has no alpha (1
/// everywhere), it is where the rendering's opacity does.
/// @param progress  called after each view with how many are done and how many there are; false ends the
///                  evaluation with the views so far. May be empty
/// @param lpips     the network of ViewScore::lpips, or null
/// @throws ValueError if there are no views
Evaluation evaluate(Renderer& renderer, const Dataset& dataset,
                    const std::function<bool(Index done, Index total)>& progress = {},
                    const Lpips<float>* lpips = nullptr);

}  // namespace fieldmark::nerf
