#pragma once
#include <fieldmark/watermark/mark/view_cache.h>

#include <vector>

namespace fieldmark::watermark {

/// Returns the first sample of every pixel, or of its nearest neighbour if it has none: an empty pixel
/// changes when the silhouette moves.
/// @param reach  largest distance of the neighbour, pixels   @return [H W] number of a sample, -1: none
std::vector<std::int32_t> nearest_sample(const CachedView& view, Index reach);

}  // namespace fieldmark::watermark
