#include "table_rows.h"
#include <fieldmark/nerf/renderer.h>

#include <algorithm>

#include "hash_reference.h"
#include "small_field.h"
#include "support/catch.h"
#include "support/random.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
// Returns a grid whose occupied cells form a spherical shell: they read part of the rows of coarse and of
// hashed levels.
OccupancyGrid shell(Index resolution) {
  OccupancyGrid grid(resolution);
  std::vector<std::uint8_t> bits(static_cast<std::size_t>(grid.cells()));
  for (Index c = 0; c < grid.cells(); ++c) {
    const auto at = [&](Index i) {
      return (static_cast<double>(i) + 0.5) / static_cast<double>(resolution) - 0.4;
    };
    const double x = at(c % resolution), y = at(c / resolution % resolution),
                 z = at(c / (resolution * resolution)), r = x * x + y * y + z * z;
    bits[static_cast<std::size_t>(c)] = r > 0.04 && r < 0.09;
  }
  grid.set_bits(bits);
  return grid;
}
}  // namespace

TEST_CASE("table_rows: every row that a point of an occupied cell reads, by the formulas, and few others") {
  ParamStore<float> store;
  const HashEncoding<float> encoding(
      store, "hash", {.levels = 4, .log2_table = 14, .base_resolution = 5, .finest_resolution = 60}, 1);
  const OccupancyGrid grid = shell(16);
  const auto used = rows_in_use(encoding, grid);
  REQUIRE(std::ssize(used) == encoding.rows());
  std::vector<std::uint8_t> read(used.size());
  const auto u = uniform({400000, 3}, 0, 1, 3);
  for (Index i = 0; i < 400000; ++i) {
    const std::array<double, 3> x{u[3 * i], u[3 * i + 1], u[3 * i + 2]};
    const auto cell = [&](std::size_t a) { return static_cast<Index>(16 * x[a]); };
    if (!grid.occupied(grid.cell(cell(0), cell(1), cell(2)))) continue;
    for (int l = 0; l < encoding.levels(); ++l) {
      const std::int64_t table = encoding.mask(l) ? std::int64_t{encoding.mask(l)} + 1 : 0;
      for (const HashCorner& c : hash_corners(encoding.resolution(l), table, x))
        read[static_cast<std::size_t>(encoding.first_row(l) + c.row)] = 1;
    }
  }
  CHECK(encoding.mask(0) == 0);
  CHECK(encoding.mask(3) == (1u << 14) - 1);
  for (int l = 0; l < encoding.levels(); ++l) {
    Index missed = 0, spare = 0, kept = 0;
    for (Index r = encoding.first_row(l); r < encoding.first_row(l + 1); ++r) {
      const auto at = static_cast<std::size_t>(r);
      missed += read[at] && !used[at];
      spare += used[at] && !read[at];
      kept += used[at];
    }
    CAPTURE(l);
    CHECK(missed == 0);
    CHECK(10 * spare <= kept);  // rows read only within 1e-5 of a face, or that no random point hit
    CHECK(kept < encoding.first_row(l + 1) - encoding.first_row(l));
  }
}

TEST_CASE("table_rows: an empty grid reads nothing, a full one everything direct") {
  ParamStore<float> store;
  const HashEncoding<float> encoding(
      store, "hash", {.levels = 2, .log2_table = 10, .base_resolution = 4, .finest_resolution = 30}, 1);
  OccupancyGrid grid(8);
  const auto all = rows_in_use(encoding, grid);
  CHECK(std::all_of(all.begin(), all.end(), [](std::uint8_t v) { return v == 1; }));
  grid.set_bits(std::vector<std::uint8_t>(512, 0));
  const auto none = rows_in_use(encoding, grid);
  CHECK(std::all_of(none.begin(), none.end(), [](std::uint8_t v) { return v == 0; }));
}

TEST_CASE("table_rows: a field's file leaves rows out, and its images are the same") {
  const TemporaryFolder folder;
  RadianceField f = small_field();
  const OccupancyGrid grid = shell(f.grid.resolution());
  f.grid.set_bits(grid.bits());
  f.save(folder / "field");
  const SafetensorsFile file = SafetensorsFile::read(folder / "field");
  REQUIRE(file.has("hash/rows"));
  CHECK(file.at("hash/colour_features").shape[0] < f.field.encoding().rows());
  const RadianceField g = RadianceField::load(folder / "field");
  const Camera camera = make_camera(look_at({2, 1, 3}, {0, 0, 0}, {0, 1, 0}), 0.9, 32, 24);
  const Rendering a = Renderer(f).render(camera), b = Renderer(g).render(camera);
  CHECK(a.rgb.data == b.rgb.data);
  CHECK(a.opacity.data == b.opacity.data);
  CHECK(*std::max_element(a.opacity.data.begin(), a.opacity.data.end()) > 0);
  g.save(folder / "again");
  CHECK(std::filesystem::file_size(folder / "again") == std::filesystem::file_size(folder / "field"));
}
