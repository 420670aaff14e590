#include "nearest_sample.h"
#include <fieldmark/engine/parallel.h>

#include "ordered_sum.h"

namespace fieldmark::watermark {

std::vector<std::int32_t> nearest_sample(const CachedView& view, Index reach) {
  const Index h = view.height, w = view.width;
  const auto sample = [&](Index y, Index x) {
    const auto p = at(y * w + x);
    return view.sample_begin[p] < view.sample_begin[p + 1] ? view.sample_begin[p] : -1;
  };
  const auto nearest_to = [&](Index y, Index x) {
    std::int32_t found = sample(y, x);
    Index nearest = found >= 0 ? 0 : reach * reach + 1;
    for (Index dy = -reach; nearest > 0 && dy <= reach; ++dy)
      for (Index dx = -reach; dx <= reach; ++dx) {
        if (y + dy < 0 || y + dy >= h || x + dx < 0 || x + dx >= w) continue;
        const Index distance = dy * dy + dx * dx;
        const std::int32_t other = distance < nearest ? sample(y + dy, x + dx) : -1;
        if (other < 0) continue;
        nearest = distance;
        found = other;
      }
    return found;
  };
  std::vector<std::int32_t> seen(at(h * w));
  parallel_for(h * w, kPixelChunk, [&](Index begin, Index end) {
    for (Index p = begin; p < end; ++p) seen[at(p)] = nearest_to(p / w, p % w);
  });
  return seen;
}

}  // namespace fieldmark::watermark
