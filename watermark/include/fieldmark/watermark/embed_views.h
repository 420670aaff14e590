#pragma once
#include <fieldmark/watermark/cell_grid.h>
#include <fieldmark/watermark/view_cache.h>

#include <functional>

namespace fieldmark::watermark {

/// Renders and caches the views to embed in: near cameras, each cut to the object's window at the reader's
/// size as the reader will cut a picture (see object_window.h).
/// @param progress  called after each view with (done, total); returns false to stop, which throws Error
std::vector<CachedView> cache_near_views(const nerf::RadianceField& field, Index reader_size, Index count,
                                         std::uint64_t seed,
                                         const std::function<bool(Index, Index)>& progress = {});

/// Visible area of the cells of a grid over the cube, summed over views. @return [side^3]
std::vector<double> visible_area(std::span<const CachedView> views, Index side);

}  // namespace fieldmark::watermark
