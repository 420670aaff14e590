#pragma once
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/watermark/mark/owner.h>

#include <functional>

namespace fieldmark::watermark {

/// Options of the adversarial attack on the extractor.
struct ExtractorAttackOptions {
  double mark_psnr = 34;   ///< PSNR of attacked against given images on the foreground, dB, 10 to 60
  Index steps = 20;        ///< of gradient ascent, >= 1
  double step = 0.3;       ///< step length relative to the whole change, in (0, 1]
  std::uint64_t seed = 0;  ///< of the initial change
};

/// Attacks an image adversarially, knowing the extractor but neither the key nor the unmarked field. Gradient
/// ascent moves the image away from the extractor's own verdict:
///   r_{k+1} = B(r_k / |r_k| + step g / |g|),   g = d L(x + r_k) / d r_k,
///   L = mean over the foreground of BCE(sign, [sign(x) > 0]) + CE(index, argmax index(x));
/// for presets paper and code, L = BCE(logits, [logits(x) > 0]). B scales the change to `mark_psnr` on the
/// foreground (power_budget()); r is 0 elsewhere. Source: Madry et al. 2018, sec. 2 (projected gradient
/// descent). Departures: r stays on the surface of the ball, one random start.
/// @param owner  only its extractor is used   @param image  [H, W, 3] in [0, 1], sides of at least 16
/// @param object  [H, W], above 0.5 on the foreground   @return the attacked image, in [0, 1]
/// @throws ShapeError if shapes do not fit   @throws ValueError if an option is out of range
Tensor<float> against_extractor(const Owner& owner, const Tensor<float>& image, const Tensor<float>& object,
                                const ExtractorAttackOptions& options);

/// Renders novel views of a marked field at the extractor's size and attacks each with against_extractor().
/// Training on them carries the attack into a field.
/// @param views  at least 1   @param progress  called after each view; returns false to stop, which throws
/// Error
nerf::Dataset renders_against_extractor(const Owner& owner, const nerf::RadianceField& field, Index views,
                                        const ExtractorAttackOptions& options,
                                        const std::function<bool(Index done, Index total)>& progress = {});

}  // namespace fieldmark::watermark
