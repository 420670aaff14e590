#include <fieldmark/core/error.h>
#include <fieldmark/watermark/mark/cell_grid.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
// Returns all 8 cells of a grid of 2 per side, in the order of the grid.
CellGrid full_grid() { return {2, std::vector<double>(8, 1.0)}; }

float sign_at(const CellGrid& grid, const std::vector<std::int8_t>& signs, float x, float y, float z) {
  const float p[3] = {x, y, z};
  float s = 99;
  grid.blend(signs, p, 1, &s);
  return s;
}
}  // namespace

TEST_CASE("cell_grid: cells are what is visible, in the grid's order, with their part of the area") {
  std::vector<double> area(27, 0.0);
  area[4] = 3;
  area[13] = 1;
  area[20] = 3e-5;  // less than a hundred-thousandth of the total
  const CellGrid grid(3, area);
  REQUIRE(grid.count() == 2);
  const double total = 4.00003;
  CHECK(grid.area()[0] == Approx(3 / total).epsilon(1e-14));
  CHECK(grid.area()[1] == Approx(1 / total).epsilon(1e-14));
  for (std::size_t i = 0; i < 27; ++i) CHECK(grid.numbers()[i] == (i == 4 ? 0 : i == 13 ? 1 : -1));
  const float middle[3] = {0.5f, 0.5f, 0.5f}, corner[3] = {0, 0, 0};
  CHECK(grid.at(middle) == 1);
  CHECK(grid.at(corner) == -1);
}

TEST_CASE(
    "cell_grid: a face belongs to the cell above it, what is outside goes to the nearest and NaN to 0") {
  const auto place = [](float x, float y, float z) {
    const float p[3] = {x, y, z};
    return CellGrid::place(4, p);
  };
  CHECK(place(0, 0, 0) == 0);
  CHECK(place(0.25f, 0, 0) == 1);
  CHECK(place(std::nextafter(0.25f, 0.f), 0, 0) == 0);
  CHECK(place(0, 0.5f, 0) == 8);
  CHECK(place(0, 0, 0.75f) == 48);
  CHECK(place(1, 1, 1) == 63);
  CHECK(place(-5, 7, 1e30f) == 0 + 4 * 3 + 16 * 3);
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  CHECK(place(nan, nan, 0.3f) == 16);
  CHECK(place(inf, -inf, 0) == 3);
}

TEST_CASE("cell_grid: blended signs are a cell's own around its centre and cross 0 only where signs change") {
  const CellGrid grid = full_grid();
  // Positive below x = 1/2, negative above.
  const std::vector<std::int8_t> split{1, -1, 1, -1, 1, -1, 1, -1};
  for (float y : {0.f, 0.3f, 0.5f, 0.9f}) {
    CHECK(sign_at(grid, split, 0.25f, y, 0.6f) == 1);
    CHECK(sign_at(grid, split, 0.4f, y, 0.6f) == 1);
    CHECK(sign_at(grid, split, 0.75f, y, 0.6f) == -1);
    CHECK(sign_at(grid, split, 0.5f, y, 0.6f) == Approx(0).margin(1e-6));
    // f = 0.55 of the way between the centres: 3 (1 - 2 f).
    CHECK(sign_at(grid, split, 0.525f, y, 0.6f) == Approx(-0.3).margin(1e-5));
  }
  float before = 2;
  for (int i = 0; i <= 50; ++i) {
    const float s = sign_at(grid, split, static_cast<float>(i) / 50, 0.4f, 0.4f);
    CHECK(s <= before);
    before = s;
  }
  const std::vector<std::int8_t> equal(8, -1);
  for (int i = 0; i <= 20; ++i)
    CHECK(sign_at(grid, equal, static_cast<float>(i) / 20, 0.5f, static_cast<float>(20 - i) / 20) == -1);
}

TEST_CASE("cell_grid: blending leaves out what is no cell, and cells without a sign pull to 0") {
  std::vector<double> area(8, 0.0);
  area[0] = 1;
  const CellGrid lone(2, area);
  CHECK(sign_at(lone, {1}, 0.6f, 0.6f, 0.6f) == 1);
  // At the centre of a box without a cell, all weight lies there.
  CHECK(sign_at(lone, {1}, 0.75f, 0.75f, 0.75f) == 0);
  std::vector<std::int8_t> unsigned_half{1, 0, 1, 0, 1, 0, 1, 0};
  CHECK(sign_at(full_grid(), unsigned_half, 0.75f, 0.2f, 0.2f) == 0);
  CHECK(sign_at(full_grid(), unsigned_half, 0.7f, 0.2f, 0.2f) == Approx(0.3).margin(1e-5));
}

TEST_CASE("cell_grid: stored numbers and areas give the same grid") {
  std::vector<double> area(64);
  for (std::size_t i = 0; i < area.size(); ++i) area[i] = i % 3 == 0 ? static_cast<double>(i) : 0.0;
  const CellGrid grid(4, area), again = CellGrid::from_numbers(4, grid.numbers(), grid.area());
  CHECK(again.side() == 4);
  CHECK(again.count() == 21);
  CHECK(std::vector(again.numbers().begin(), again.numbers().end()) ==
        std::vector(grid.numbers().begin(), grid.numbers().end()));
  CHECK(std::vector(again.area().begin(), again.area().end()) ==
        std::vector(grid.area().begin(), grid.area().end()));
}

TEST_CASE("cell_grid: errors name what is wrong") {
  const std::vector<double> eight(8, 1.0), dark(8, 0.0);
  CHECK_THROWS_WITH(CellGrid(1, eight), "[cell_grid] side must be 2 to 64 cells, got 1");
  CHECK_THROWS_WITH(CellGrid(65, eight), "[cell_grid] side must be 2 to 64 cells, got 65");
  CHECK_THROWS_AS(CellGrid(3, eight), ShapeError);
  CHECK_THROWS_WITH(CellGrid(3, eight), "[cell_grid] area must have 27 entries, got 8");
  CHECK_THROWS_AS(CellGrid(2, dark), ValueError);
  CHECK_THROWS_WITH(CellGrid(2, dark), "[cell_grid] area must be positive somewhere: no view shows anything");
  const std::vector<std::int32_t> good{0, -1, 1, 2, -1, -1, -1, 3}, gap{0, -1, 2, 3, -1, -1, -1, 4},
      shuffled{1, -1, 0, 2, -1, -1, -1, 3}, few{0, 1, 2, 3};
  const std::vector<double> four(4, 0.25), five(5, 0.2);
  CHECK(CellGrid::from_numbers(2, good, four).count() == 4);
  for (const auto& bad : {gap, shuffled, few}) {
    CHECK_THROWS_AS(CellGrid::from_numbers(2, bad, four), ValueError);
    CHECK_THROWS_WITH(CellGrid::from_numbers(2, bad, four),
                      "[cell_grid] numbers must count 4 cells in the order of a grid of 2 a side");
  }
  CHECK_THROWS_AS(CellGrid::from_numbers(2, good, five), ValueError);
  CHECK_THROWS_WITH(CellGrid::from_numbers(1, good, four), "[cell_grid] side must be 2 to 64 cells, got 1");
}

TEST_CASE("cell_grid: positions outside or not numbers are blended as the nearest place, cell 0 for NaN") {
  const std::vector<double> area(8, 1.0);
  const CellGrid grid(2, area);
  const std::vector<std::int8_t> signs{1, -1, 1, -1, 1, -1, 1, -1};
  const float nan = std::nanf(""), inf = std::numeric_limits<float>::infinity();
  const float x[] = {nan, nan, nan, 0, 0, 0, inf, 0, 0, 1, 0, 0, -inf, 5, -5, 0, 1, 0};
  float s[6];
  grid.blend(signs, x, 6, s);
  CHECK(s[0] == s[1]);
  CHECK(s[2] == s[3]);
  CHECK(s[4] == s[5]);
}

TEST_CASE("cell_grid: mix is the mean over all signs of a cell's sign times their blend") {
  // 2 x 2 x 2 cells, all or all but one, few enough to try every choice of signs.
  const double fifth = GENERATE(0.0, 5.0);
  const std::vector<double> area{1, 2, 3, 4, fifth, 1, 2, 3};
  const CellGrid grid(2, area);
  const auto cells = static_cast<std::size_t>(grid.count());
  REQUIRE(cells == (fifth > 0 ? 8 : 7));
  const auto u = uniform({60, 3}, 0, 1, 4);
  Index inside = 0;
  for (Index i = 0; i < 60; ++i) {
    const float x[3]{static_cast<float>(u[3 * i]), static_cast<float>(u[3 * i + 1]),
                     static_cast<float>(u[3 * i + 2])};
    std::vector<double> want(cells), got(cells);
    const int ways = 1 << cells;
    for (int way = 0; way < ways; ++way) {
      std::vector<std::int8_t> signs(cells);
      for (std::size_t c = 0; c < cells; ++c) signs[c] = (way >> c & 1) != 0 ? -1 : 1;
      float s = 0;
      grid.blend(signs, x, 1, &s);
      for (std::size_t c = 0; c < cells; ++c) want[c] += signs[c] * static_cast<double>(s) / ways;
    }
    const CellGrid::Mix mix = grid.mix(x);
    for (std::size_t k = 0; k < static_cast<std::size_t>(mix.count); ++k)
      got[static_cast<std::size_t>(mix.cell[k])] = static_cast<double>(mix.part[k]);
    for (std::size_t c = 0; c < cells; ++c) CHECK(got[c] == Approx(want[c]).margin(1e-6));
    inside += std::count(got.begin(), got.end(), 1.0);
  }
  CHECK((inside > 3 && inside < 57));
}
