#pragma once
#include <fieldmark/watermark/mark/view_cache.h>

#include <span>
#include <vector>

namespace fieldmark::watermark {

/// Computes how flat the unmarked image is around each pixel of the foreground, where eyes find a mark first:
///   exp(-(s / 0.03)^2),   s: standard deviation of the green channel in 5 x 5 pixels
/// @param foreground  [pixels], see foreground_mask()
/// @return [pixels, 3] in [0, 1], the same for all three channels; 0 where foreground is 0
std::vector<float> flatness(const CachedView& view, const std::vector<float>& foreground);
/// Returns the mean of flatness() over the foreground of all views, 0 if they show nothing: 0.05 for a scene
/// full of detail, 0.5 for blocks of one colour.
double flat_share(std::span<const CachedView> views);

}  // namespace fieldmark::watermark
