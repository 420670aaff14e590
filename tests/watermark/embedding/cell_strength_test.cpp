#include "cell_strength.h"

#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <numeric>

#include "support/catch.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("cell_strength: cells that a view does not show have none, and those that it shows have most") {
  const Owner owner = marking_owner();
  const std::vector<CachedView>& views = tiny_views();
  const auto strength = cell_strength(owner, views, 1);
  const auto cells = static_cast<std::size_t>(owner.cells.count());
  REQUIRE(strength.size() % cells == 0);
  const std::size_t count = strength.size() / cells;
  REQUIRE(count == std::min(views.size(), static_cast<std::size_t>(kStrengthViews)));
  for (std::size_t v = 0; v < count; ++v) {
    // An untrained extractor reads noise, but the change of colour is where the cells are.
    const CachedView& view = views[v * views.size() / count];
    std::vector<double> area(cells);
    for (std::size_t p = 0; p + 1 < view.sample_begin.size(); ++p) {
      if (view.sample_begin[p] == view.sample_begin[p + 1]) continue;
      const auto cell = owner.cells.at(&view.position[3 * static_cast<std::size_t>(view.sample_begin[p])]);
      if (cell >= 0) area[static_cast<std::size_t>(cell)] += 1;
    }
    double shown = 0, all = 0;
    for (std::size_t c = 0; c < cells; ++c) {
      const std::int32_t s = strength[v * cells + c];
      CHECK(s >= 0);
      all += s;
      if (area[c] > 0) shown += s;
    }
    CHECK(all > 0.4 * (1 << 20));
    CHECK(all < 1.01 * (1 << 20));
    CHECK(shown > 0.45 * (1 << 20));
  }
}

TEST_CASE("cell_strength: the same for any number of threads, other codes for another seed") {
  const Owner owner = marking_owner();
  const std::span<const CachedView> views = std::span(tiny_views()).first(2);
  std::vector<std::vector<std::int32_t>> all;
  for (const int threads : {1, 2, 3}) {
    const ScopedThreads scope(threads);
    all.push_back(cell_strength(owner, views, 5));
  }
  CHECK(all[0] == all[1]);
  CHECK(all[0] == all[2]);
  CHECK(all[0] != cell_strength(owner, views, 6));
}

TEST_CASE("cell_strength: views of another size than the extractor's are left out") {
  const Owner owner = marking_owner();
  std::vector<CachedView> views(1, tiny_views().front());
  views.front().height -= 1;
  CHECK(cell_strength(owner, views, 1).empty());
}
