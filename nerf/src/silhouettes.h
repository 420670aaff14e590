#pragma once
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/space.h>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace fieldmark::nerf {

/// Returns true if a pixel of a view is valid, see View::valid.
bool is_valid(const View& v, Index pixel);

/// Computes the visual hull (Laurentini 1994): the cells of a grid over `bounds` that no silhouette rules
/// out. A view rules a cell out only if the cell's projection, enlarged to the circle around its corners,
/// lies in the image and meets no pixel that is invalid or has alpha > 0.
/// @param resolution  cells per axis, a multiple of 4, at most 512   @return [cells] x fastest, 1 for the
/// hull
/// @throws ShapeError if an image is not [H, W, 4]   @throws ValueError if resolution is out of range
std::vector<std::uint8_t> visual_hull(std::span<const View> views, const Bounds& bounds, Index resolution);

/// Returns the smallest cube around the hull, enlarged by two cells; `bounds` itself if the hull is empty or
/// full.
Bounds tighten(const Bounds& bounds, std::span<const std::uint8_t> hull, Index resolution);

/// Returns the maximum number of pixels in any view by which a cell of the hull may extend beyond its
/// silhouette: the diagonal of a cell of `bounds` at the distance of the cube's nearest point, plus four
/// pixels for the hull's own margins.
/// @param resolution  cells per axis, at least 1
Index hull_margin(std::span<const View> views, const Bounds& bounds, Index resolution);

/// Returns the pixels worth a training ray: valid pixels within a square of `margin` pixels around one that
/// is invalid or has alpha > 0; without a margin, all valid pixels. Rays through the others pass only through
/// cells outside the hull (except where the scene leaves the image).
/// @return [n] view * height * width + y * width + x, rising   @throws ValueError if margin is negative or
/// the views have too many pixels for 32 bits
std::vector<std::uint32_t> training_pixels(std::span<const View> views, std::optional<Index> margin);

}  // namespace fieldmark::nerf
