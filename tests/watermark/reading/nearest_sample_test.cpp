#include "nearest_sample.h"

#include <algorithm>
#include <iterator>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
// A view of 30 x 40 pixels with one sample in every pixel of a rectangle, and in one pixel alone.
CachedView view_of_shapes() {
  CachedView v;
  v.height = 30;
  v.width = 40;
  v.sample_begin = {0};
  for (Index y = 0; y < 30; ++y)
    for (Index x = 0; x < 40; ++x) {
      const bool shown = (y >= 8 && y < 15 && x >= 10 && x < 22) || (y == 20 && x == 30);
      v.sample_begin.push_back(v.sample_begin.back() + (shown ? 1 : 0));
    }
  return v;
}
}  // namespace

TEST_CASE(
    "nearest_sample: an empty pixel has the sample of a nearest neighbour, on all sides of a silhouette") {
  const CachedView v = view_of_shapes();
  for (const Index reach : {0, 1, 3}) {
    const auto seen = nearest_sample(v, reach);
    REQUIRE(std::ssize(seen) == 1200);
    Index filled = 0;
    for (Index y = 0; y < 30; ++y)
      for (Index x = 0; x < 40; ++x) {
        CAPTURE(reach, y, x);
        Index nearest = reach * reach + 1,
              given = -1;  // squared distances: least of all, and of the pixel given
        for (Index j = 0; j < 30; ++j)
          for (Index i = 0; i < 40; ++i) {
            const auto p = static_cast<std::size_t>(j * 40 + i);
            if (v.sample_begin[p] == v.sample_begin[p + 1]) continue;
            const Index distance = (j - y) * (j - y) + (i - x) * (i - x);
            nearest = std::min(nearest, distance);
            if (v.sample_begin[p] == seen[static_cast<std::size_t>(y * 40 + x)]) given = distance;
          }
        CHECK(given == (nearest > reach * reach ? -1 : nearest));
        filled += given > 0;
      }
    CHECK(filled == (reach == 0 ? 0 : reach == 1 ? 42 : 158));
  }
}
