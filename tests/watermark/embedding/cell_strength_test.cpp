#include "cell_strength.h"

#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <numeric>

#include "support/catch.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("cell_strength: cells that a view shows have most of it") {
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

TEST_CASE("cell_strength: smaller views are enlarged, and of many views some of each kind are drawn") {
  const Owner owner = marking_owner();
  const auto small = cache_novel_views(tiny_field(), square_patch(32), 1, 3);
  const auto cells = static_cast<std::size_t>(owner.cells.count());
  CHECK(cell_strength(owner, small, 1).size() == cells);
  // Every second view shows nothing, as every second view of an object is from another kind of camera.
  CachedView blank = small.front();
  blank.position.clear();
  blank.direction.clear();
  blank.colour.clear();
  blank.weight.clear();
  std::ranges::fill(blank.sample_begin, 0);
  std::vector<CachedView> views;
  for (Index v = 0; v < 2 * kStrengthViews; ++v) views.push_back(v % 2 == 0 ? blank : small.front());
  const auto strength = cell_strength(owner, views, 1);
  REQUIRE(strength.size() == static_cast<std::size_t>(kStrengthViews) * cells);
  // The change of colour alone gives half of 2^20; noise that the extractor reads gives the other half.
  Index shown = 0;
  for (std::size_t v = 0; v < strength.size(); v += cells)
    shown += std::accumulate(&strength[v], &strength[v] + cells, Index{0}) > 3 << 18;
  CHECK(shown > kStrengthViews / 4);
  CHECK(shown < 3 * kStrengthViews / 4);
}
