#pragma once
#include <fieldmark/watermark/mark/view_cache.h>

#include <vector>

namespace fieldmark::watermark {

/// Computes how flat the unmarked image is around each pixel of the foreground, where eyes find a mark first:
///   exp(-(s / 0.03)^2),   s: standard deviation of the green channel in 5 x 5 pixels
/// @param foreground  [pixels], see foreground_mask()
/// @return [pixels, 3] in [0, 1], the same for all three channels; 0 where foreground is 0
std::vector<float> flatness(const CachedView& view, const std::vector<float>& foreground);

}  // namespace fieldmark::watermark
