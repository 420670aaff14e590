#pragma once
#include <fieldmark/engine/shape.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace fieldmark {

/// Neighbours of a pixel: those that share an edge, or those that share an edge or a corner.
enum class Neighbours { four, eight };

/// Returns the pixels connected to the starts by accepted pixels, each once; a start counts only if accepted.
/// @param starts  y width + x   @param accept  called at most once per pixel with y width + x, returns bool
template <class Accept>
std::vector<Index> flood_fill(Index height, Index width, std::span<const Index> starts, Accept accept,
                              Neighbours neighbours = Neighbours::four) {
  std::vector<std::uint8_t> met(at(height * width));
  std::vector<Index> found;
  const auto meet = [&](Index p) {
    if (met[at(p)]) return;
    met[at(p)] = 1;
    if (accept(p)) found.push_back(p);
  };
  for (const Index p : starts) meet(p);
  for (std::size_t next = 0; next < found.size(); ++next) {
    const Index x = found[next] % width, y = found[next] / width;
    for (Index v = std::max<Index>(y - 1, 0); v <= std::min(y + 1, height - 1); ++v)
      for (Index u = std::max<Index>(x - 1, 0); u <= std::min(x + 1, width - 1); ++u)
        if (neighbours == Neighbours::eight || u == x || v == y) meet(v * width + u);
  }
  return found;
}

}  // namespace fieldmark
