#pragma once
#include <fieldmark/watermark/mark/owner.h>

#include <span>
#include <vector>

namespace fieldmark::watermark {

/// Measures how much of each cell views show, for CellGrid::set_strength(). In each view the mark is drawn
/// under a few random codes. With the sign s_c of a cell, its evidence S_c in the extractor's reading and the
/// change of colour d_p of its pixels p, which has the sign s_p (near other cells their signs blend in),
///   E_c = max(0, mean s_c S_c),   D_c = sqrt(max(0, mean sum_p s_c s_p |d_p|)),   means over codes,
///   strength_vc = 2^19 (E_c / sum_c E_c + D_c / sum_c D_c).
/// The first part is what blind detection reads; the second is what informed detection measures, whose sign
/// estimates saturate.
/// @param views  from which kStrengthViews are drawn if there are more; at most of the extractor's size
/// @param seed   of the codes and of the draw   @return [views, cells]
std::vector<std::int32_t> cell_strength(const Owner& owner, std::span<const CachedView> views,
                                        std::uint64_t seed);

inline constexpr Index kStrengthViews = 64;  ///< most views that cell_strength() measures

}  // namespace fieldmark::watermark
