#include <fieldmark/core/error.h>
#include <fieldmark/tools/bench/field_variants.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "nerf/small_field.h"
#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::bench;

namespace {
bool all_set(const nerf::OccupancyGrid& grid) { return grid.occupied_cells() == grid.cells(); }

// True if the density exceeds the threshold at one of 3^3 positions in a cell of a grid of n cells per side.
bool dense(const nerf::RadianceField& f, Index n, Index x, Index y, Index z) {
  for (int k = 0; k < 27; ++k) {
    const auto side = static_cast<float>(3 * n);
    const Tensor<float> at({1, 3}, {(static_cast<float>(3 * x + k % 3) + 0.5f) / side,
                                    (static_cast<float>(3 * y + k / 3 % 3) + 0.5f) / side,
                                    (static_cast<float>(3 * z + k / 9) + 0.5f) / side});
    const Tensor<float> d({1, 3}, {0, 0, 1});
    Tape<float> tape;
    const auto y1 = f.field(Params<float>(f.params, nullptr), tape.constant(at), tape.constant(d));
    if (y1.sigma.value()[0] * f.step() > 0.01f) return true;
  }
  return false;
}
}  // namespace

TEST_CASE("field_variants: the default comes first, names are single, each differs from it") {
  const nerf::RadianceField f = small_field();
  const auto all = field_variants(f);
  REQUIRE(all.size() > 25);
  CHECK(all.front().knob == "default");
  std::set<std::string> names;
  for (const FieldVariant& v : all) names.insert(v.knob + " " + v.setting);
  CHECK(names.size() == all.size());
  for (const char* knob : {"samples", "stop", "least weight", "occupancy", "together"})
    CHECK(std::any_of(all.begin(), all.end(), [&](const auto& v) { return v.knob == knob; }));
  const auto few = field_variants(f, true);
  CHECK(few.size() < 10);
  std::set<std::string> knobs, knobs_of_few;
  for (const FieldVariant& v : all) knobs.insert(v.knob);
  for (const FieldVariant& v : few) knobs_of_few.insert(v.knob);
  CHECK(knobs == knobs_of_few);
}

TEST_CASE("field_variants: a coarser grid holds every cell of the field's, and no block without one") {
  nerf::RadianceField f = small_field();
  std::vector<std::uint8_t> bits(static_cast<std::size_t>(f.grid.cells()), 0);
  const Index n = f.grid.resolution(), seen = f.grid.cell(9, 2, 15);
  bits[static_cast<std::size_t>(seen)] = 1;
  f.grid.set_bits(bits);
  const nerf::OccupancyGrid half = occupancy_at(f, n / 2);
  CHECK(half.occupied_cells() == 1);
  CHECK(half.occupied(half.cell(4, 1, 7)));
}

TEST_CASE("field_variants: a finer grid holds the parts where a density passes the threshold") {
  nerf::RadianceField f = small_field();
  f.params.values(f.params.find("density/1/bias"))[0] -= 1;  // moves densities to both sides of the threshold
  std::vector<std::uint8_t> bits(static_cast<std::size_t>(f.grid.cells()), 0);
  const Index n = f.grid.resolution();
  for (std::size_t c = 0; c < bits.size(); c += 37) bits[c] = 1;
  f.grid.set_bits(bits);
  for (const Index factor : {1, 2}) {
    const nerf::OccupancyGrid to = occupancy_at(f, factor * n);
    Index wrong = 0;
    for (Index c = 0; c < to.cells(); ++c) {
      const Index side = to.resolution(), x = c % side, y = c / side % side, z = c / (side * side);
      const bool want =
          f.grid.occupied(f.grid.cell(x / factor, y / factor, z / factor)) && dense(f, side, x, y, z);
      wrong += to.occupied(c) != want;
    }
    CHECK(wrong == 0);
    CHECK(to.occupied_cells() > 0);
    CHECK(to.occupied_cells() < f.grid.occupied_cells() * factor * factor * factor);
  }
  CHECK_THROWS_WITH(occupancy_at(f, 12),
                    "[occupancy_at] resolution must divide 16 or be a multiple of it, got 12");
}

TEST_CASE("field_variants: a variant's field has its grid, and all else of the field") {
  nerf::RadianceField f = small_field();
  f.space.bounds = {.corner = {-1, -1.2, -0.9}, .side = 2.1};
  f.background = nerf::Background::black;
  std::vector<std::uint8_t> bits(static_cast<std::size_t>(f.grid.cells()), 1);
  bits[7] = 0;
  f.grid.set_bits(bits);
  const nerf::RadianceField same = with_variant(f, {});
  CHECK(same.options().step == f.options().step);
  CHECK(std::ranges::equal(same.grid.bits(), f.grid.bits()));
  CHECK(std::ranges::equal(same.params.values(), f.params.values()));
  CHECK(same.space.bounds.side == f.space.bounds.side);
  CHECK(same.background == f.background);
  const nerf::RadianceField other = with_variant(f, {.knob = "", .setting = "", .skip_empty = false});
  CHECK(all_set(other.grid));
  CHECK(with_variant(f, {.knob = "", .setting = "", .occupancy = 8}).grid.resolution() == 8);
}
