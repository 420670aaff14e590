#pragma once
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/visual_hull.h>

#include <cstdint>
#include <span>
#include <vector>

namespace fieldmark::nerf {

/// How far, in pixels of any view, a cell of the visual hull may reach beyond the silhouette that keeps it:
/// the diagonal of a cell of `bounds` at the distance of the cube's nearest point, and four pixels for the
/// hull's own margins.
/// @param resolution  cells per axis, at least 1
Index hull_margin(std::span<const View> views, const Bounds& bounds, Index resolution);

/// The pixels worth a training ray: those within a square of `margin` pixels around one with alpha > 0. A ray
/// through any other passes only cells that the visual hull has ruled out, and teaches nothing (but where the
/// scene leaves the image: of what lies beyond its edge the hull knows nothing).
/// @return [n] view * height * width + y * width + x, rising   @throws ValueError if margin is negative or
/// the views have too many pixels for 32 bits
std::vector<std::uint32_t> training_pixels(std::span<const View> views, Index margin);

}  // namespace fieldmark::nerf
