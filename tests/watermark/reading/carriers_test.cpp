#include "carriers.h"
#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/watermark/mark/cell_code.h>

#include <cmath>
#include <set>

#include "support/catch.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
nerf::Camera carrier_camera() {
  return nerf::make_cameras(tiny_field().cameras, nerf::CameraSet::novel, 1, 64, 3).front();
}

CachedView view_of(const Owner& owner, Index samples) {
  nerf::Renderer renderer(owner.field, {.finer = 1});
  return cache_view(renderer, owner.field, carrier_camera(), samples);
}

Tensor<float> rendered(const Owner& owner, const std::vector<std::int8_t>& signs) {
  nerf::Renderer renderer(owner.field, {.finer = 1});
  renderer.set_recolour(owner.marking(signs));
  return renderer.render(carrier_camera()).rgb;
}

// Root mean square of a marked view's difference after the carriers are removed, and before.
struct Left {
  double rest = 0, all = 0;
};
Left left_of(const Owner& owner, const std::vector<std::int8_t>& signs, Index samples, bool whole) {
  const CachedView view = view_of(owner, samples);
  const Carriers c = carriers(owner, view);
  const Tensor<float> marked = rendered(owner, signs);
  Left left;
  for (Index p = 0; p < view.height * view.width; ++p)
    for (Index a = 0; a < 3; ++a) {
      const auto change = static_cast<double>(marked[3 * p + a] - view.base[3 * p + a]);
      double told = whole ? static_cast<double>(c.whole[3 * p + a]) : 0;
      for (auto e = static_cast<std::size_t>(c.begin[static_cast<std::size_t>(p)]);
           !whole && e < static_cast<std::size_t>(c.begin[static_cast<std::size_t>(p) + 1]); ++e)
        told += signs[static_cast<std::size_t>(c.cell[e])] *
                static_cast<double>(c.part[3 * e + static_cast<std::size_t>(a)]);
      left.rest += std::pow(change - told, 2);
      left.all += change * change;
    }
  const auto n = static_cast<double>(marked.size());
  return {std::sqrt(left.rest / n), std::sqrt(left.all / n)};
}
}  // namespace

TEST_CASE("carriers: where all signs are alike a marked view's difference is the whole") {
  const Owner owner = marking_owner(0.05);
  const Left left =
      left_of(owner, std::vector<std::int8_t>(static_cast<std::size_t>(owner.cells.count()), 1), 64, true);
  CAPTURE(left.rest, left.all);
  CHECK(left.rest < 0.1 * left.all);  // colours that reach 0 or 1 change differently in the two directions
}

TEST_CASE("carriers: where signs differ it is about the sum of parts with their cells' signs") {
  const Owner owner = marking_owner(0.05);
  const auto signs = cell_signs(owner.code(), Message{{1, 0, 0, 1}});
  const auto left = [&](Index samples) { return left_of(owner, signs, samples, false); };
  const Left one = left(1), four = left(4), all = left(64);
  CAPTURE(one.rest, four.rest, all.rest, all.all);
  CHECK(all.rest < 0.3 * all.all);
  CHECK(all.rest < four.rest);
  CHECK(four.rest < one.rest);
}

TEST_CASE("carriers: a pixel's parts are of different cells, one alone is the whole, and some have none") {
  const Owner owner = marking_owner(0.05);
  const CachedView view = view_of(owner, 1);
  const Carriers c = carriers(owner, view);
  REQUIRE(c.begin.size() == static_cast<std::size_t>(view.height * view.width) + 1);
  REQUIRE(c.part.size() == 3 * c.cell.size());
  Index several = 0, none = 0, alone = 0;
  for (Index p = 0; p < view.height * view.width; ++p) {
    const auto from = static_cast<std::size_t>(c.begin[static_cast<std::size_t>(p)]),
               to = static_cast<std::size_t>(c.begin[static_cast<std::size_t>(p) + 1]);
    CHECK(std::set(c.cell.begin() + static_cast<long>(from), c.cell.begin() + static_cast<long>(to)).size() ==
          to - from);
    several += to - from > 1;
    none += to == from;
    if (to - from != 1) continue;
    ++alone;
    for (Index a = 0; a < 3; ++a) CHECK(c.part[3 * from + static_cast<std::size_t>(a)] == c.whole[3 * p + a]);
  }
  CHECK((several > 20 && none > 20 && alone > 20));
}

TEST_CASE("carriers: one and two threads give the same bits") {
  const Owner owner = marking_owner(0.02);
  const CachedView view = view_of(owner, 4);
  const ScopedThreads serial(1);
  const Carriers one = carriers(owner, view);
  const ScopedThreads parallel(2);
  const Carriers two = carriers(owner, view);
  CHECK(one.whole.data == two.whole.data);
  CHECK(one.begin == two.begin);
  CHECK(one.cell == two.cell);
  CHECK(one.part == two.part);
}

TEST_CASE("carriers: an owner whose message is in networks has none") {
  const Owner paper = tiny_paper_owner();
  CHECK_THROWS_WITH(carriers(paper, view_of(paper, 1)),
                    "[carriers] owner must have cells in space, got one of preset paper");
}

TEST_CASE("carriers: after a change of colour they are what the change does to a marked view") {
  const Owner owner = marking_owner(0.02);
  const CachedView view = view_of(owner, 4);
  Carriers c = carriers(owner, view);
  const Carriers before = c;
  ToneFit tones;
  tones.terms = {
      {{0.1, 0.3, 0.5, 0.1, 0, 0, 0}, {0, 0.3, 0.5, 0.1, 0.2, 0, 0}, {0, 0.1, 0.2, 0.3, 0, 0.4, 0.1}}};
  change_colours(c, view.base, tones);
  Index compared = 0;
  for (std::size_t p = 0; p + 1 < c.begin.size(); ++p) {
    if (c.begin[p] == c.begin[p + 1]) continue;
    const auto slope = tones.slope(&view.base.data[3 * p]);
    for (std::size_t a = 0; a < 3; ++a) {
      double want = 0, part = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        want += slope[a][k] * static_cast<double>(before.whole.data[3 * p + k]);
        part += slope[a][k] * static_cast<double>(before.part[3 * static_cast<std::size_t>(c.begin[p]) + k]);
      }
      CHECK(c.whole.data[3 * p + a] == Approx(want).margin(1e-6));
      CHECK(c.part[3 * static_cast<std::size_t>(c.begin[p]) + a] == Approx(part).margin(1e-6));
      ++compared;
    }
  }
  CHECK(compared > 100);
}
