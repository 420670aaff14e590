#pragma once
#include <fieldmark/engine/shape.h>
#include <fieldmark/watermark/mark/cell_grid.h>

#include <cstddef>
#include <vector>

namespace fieldmark::watermark {

/// Divides ranked cells into as many classes as there are bits, so that each view shows about as much of one
/// class as of another. Cells are taken in groups of n_bits, in their order; in a group every class gets at
/// most one cell, and each cell goes to the free class where it adds most to the utility
///   sum_v log(L_vk + s),   L_vk the strength that view v shows of class k so far,
///   s = a quarter of the mean strength of a class in a view,
/// in its linear approximation w_vc / (L_vk + s), in whole numbers; ties: the lower class. A bit is misread
/// where a view shows little of it, so the least of a view's L counts most.
/// @param ranked  cells that get a class, the strongest first
/// @return the class of each of them, 0 to n_bits - 1
std::vector<std::int32_t> balanced_classes(const CellWeights& weights, const std::vector<std::size_t>& ranked,
                                           Index n_bits);

}  // namespace fieldmark::watermark
