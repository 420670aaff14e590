#pragma once
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/watermark/mark/owner.h>

#include <functional>

namespace fieldmark::watermark {

/// How images are turned against the extractor that reads them.
struct ExtractorAttackOptions {
  double mark_psnr = 34;   ///< PSNR of changed against given images on the object, dB, 10 to 60
  Index steps = 20;        ///< of gradient ascent, >= 1
  double step = 0.3;       ///< of a step, as a share of all that is changed, in (0, 1]
  std::uint64_t seed = 0;  ///< of what the ascent begins with
};

/// Whoever has got hold of the extractor, but neither of the key nor of the unmarked field, can turn it
/// against itself: images are changed until it no longer says what it says of them now,
///   r_{k+1} = B(r_k / |r_k| + step g / |g|),   g = d L(x + r_k) / d r_k,
///   L = mean over the object of BCE(sign, [sign(x) > 0]) + CE(index, argmax index(x)),
/// for presets paper and code BCE(logits, [logits(x) > 0]); B scales to the power that `strength` leaves on
/// the object (power_budget()), r is 0 elsewhere. Of the owner only the extractor is used. Source: Madry et
/// al. 2018, sec. 2 (projected gradient descent). Departures: the ball's surface, one random start.
/// @param image  [H, W, 3] in [0, 1], sides of at least 16   @param object  [H, W], above 0.5 on the object
/// @return the changed image, in [0, 1]   @throws ShapeError if shapes do not fit   @throws ValueError if
/// an option is out of range
Tensor<float> against_extractor(const Owner& owner, const Tensor<float>& image, const Tensor<float>& object,
                                const ExtractorAttackOptions& options);

/// Novel views of a field, as large and cut as the extractor gets them, changed so: further training on them
/// puts into the field what its views agree on.
/// @param field  marked   @param views  how many, >= 1   @param progress  called after each view; returns
/// false to stop, which throws Error
nerf::Dataset renders_against_extractor(const Owner& owner, const nerf::RadianceField& field, Index views,
                                        const ExtractorAttackOptions& options,
                                        const std::function<bool(Index done, Index total)>& progress = {});

}  // namespace fieldmark::watermark
