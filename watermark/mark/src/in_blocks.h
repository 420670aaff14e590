#pragma once
#include <fieldmark/nerf/renderer.h>

#include <algorithm>

namespace fieldmark::watermark {

// Makes a Recolour from colour(tape, x, d, n, rgb), called block by block, so that activations stay in cache.
template <class F>
nerf::Renderer::Recolour in_blocks(F colour) {
  return [colour = std::move(colour)](const float* x, const float* d, Index n, float* rgb) {
    constexpr Index kBlock = 1024;  // samples
    Tape<float> tape;
    for (Index begin = 0; begin < n; begin += kBlock) {
      tape.reset();
      colour(tape, x + 3 * begin, d + 3 * begin, std::min(kBlock, n - begin), rgb + 3 * begin);
    }
  };
}

}  // namespace fieldmark::watermark
