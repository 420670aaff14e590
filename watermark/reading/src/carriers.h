#pragma once
#include <fieldmark/watermark/mark/owner.h>
#include <fieldmark/watermark/mark/view_cache.h>
#include "tone_fit.h"

namespace fieldmark::watermark {

/// What the mark adds to a view: to each pixel if all signs are +1, and the part of each cell that the
/// pixel's ray passes. The sum of a pixel's parts, each times its cell's sign, is the best linear estimate of
/// what the mark adds (see CellGrid::mix).
struct Carriers {
  Tensor<float> whole;              ///< [H, W, 3]
  std::vector<std::int32_t> begin;  ///< [H W + 1] entries of a pixel
  std::vector<std::int32_t> cell;   ///< [entries] each cell of a pixel once
  std::vector<float> part;          ///< [entries, 3]
};

/// Computes the carriers of a view: each sample is shifted by the mark as Owner::marking() does, by half of
/// the difference between signs +1 and -1, and weighted.
/// @param owner  of preset fast   @param view  of its field; with few samples per ray, parts are rough
/// @throws ValueError if the owner has no mark network
Carriers carriers(const Owner& owner, const CachedView& view);

/// Adapts the carriers to a change of colour: multiplies the values of each pixel by the slope
/// of the change there.
/// @param base  [H, W, 3] of the view
void change_colours(Carriers& mark, const Tensor<float>& base, const ToneFit& tones);

}  // namespace fieldmark::watermark
