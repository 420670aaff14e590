#pragma once
#include <fieldmark/watermark/mark/owner.h>
#include <fieldmark/watermark/mark/view_cache.h>
#include "tone_fit.h"

namespace fieldmark::watermark {

/// What the mark adds to a view: to each pixel if all signs are +1, and how much each cell that the pixel's
/// ray passes has to do with it. The sum of a pixel's parts, each with its cell's sign, is the best linear
/// guess of what the mark adds (see CellGrid::mix).
struct Carriers {
  Tensor<float> whole;              ///< [H, W, 3]
  std::vector<std::int32_t> begin;  ///< [H W + 1] entries of a pixel
  std::vector<std::int32_t> cell;   ///< [entries] each cell of a pixel once
  std::vector<float> part;          ///< [entries, 3]
};

/// Each sample of the view shifted by the mark as Owner::marking() does, half of the difference between signs
/// +1 and -1, weighted.
/// @param owner  of preset fast   @param view  of its field; with few samples of a ray parts are rough
/// @throws ValueError if the owner has no mark network
Carriers carriers(const Owner& owner, const CachedView& view);

/// What the mark adds after a change of colour: each number of a pixel times the change's slope at the pixel.
/// @param base  [H, W, 3] of the view
void change_colours(Carriers& mark, const Tensor<float>& base, const ToneFit& tones);

}  // namespace fieldmark::watermark
