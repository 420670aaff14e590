#include <fieldmark/core/error.h>
#include <fieldmark/watermark/keys/keyed_hash.h>
#include <fieldmark/watermark/mark/cell_code.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "support/catch.h"
#include "support/random.h"
#include "watermark/test_key.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
// Areas spread over three decades, a third of them zero.
std::vector<double> some_areas(Index cells) {
  auto areas = uniform({cells}, -3, 0, 5).data;
  for (std::size_t c = 0; c < areas.size(); ++c) areas[c] = c % 3 == 0 ? 0 : std::pow(10, areas[c]);
  return areas;
}
}  // namespace

TEST_CASE("cell_code: each bit gets cells and nearly equal area, no cell without area is used") {
  constexpr std::size_t kBits = 48;
  const auto area = some_areas(1500);
  const CellCode code = deal_cells(test_key(0), area, kBits);
  std::vector<double> total(kBits);
  std::vector<Index> count(kBits);
  for (std::size_t c = 0; c < area.size(); ++c) {
    CHECK((code.bit[c] >= 0) == (area[c] > 0));
    CHECK((code.sign[c] != 0) == (area[c] > 0));
    if (code.bit[c] < 0) continue;
    total[static_cast<std::size_t>(code.bit[c])] += area[c];
    ++count[static_cast<std::size_t>(code.bit[c])];
  }
  CHECK(code.carriers() == 1000);  // 20 full groups, and a last one of 40 cells
  CHECK(*std::min_element(count.begin(), count.end()) == 20);
  CHECK(*std::max_element(count.begin(), count.end()) == 21);
  const double mean = std::accumulate(total.begin(), total.end(), 0.0) / kBits;
  // Measured: at most 10% off. Dealing at random would put the totals off by sqrt(E[a^2] / (1000 / 48)) /
  // E[a] = 41% rms.
  for (double t : total) CHECK(std::abs(t - mean) < 0.12 * mean);
}

TEST_CASE("cell_code: as many cells as bits is a permutation, and the unit of area does not matter") {
  const std::vector<double> area{0.5, 0, 2, 1, 1, 0, 4};
  const CellCode code = deal_cells(test_key(1), area, 5);
  std::vector<std::int32_t> bits;
  std::copy_if(code.bit.begin(), code.bit.end(), std::back_inserter(bits), [](auto b) { return b >= 0; });
  std::sort(bits.begin(), bits.end());
  CHECK(bits == std::vector<std::int32_t>{0, 1, 2, 3, 4});
  auto scaled = area;
  for (double& a : scaled) a *= 1024;
  CHECK(deal_cells(test_key(1), scaled, 5).bit == code.bit);
}

TEST_CASE("cell_code: under other keys signs and bits are fair and independent") {
  constexpr Index kCells = 60, kBits = 6;
  constexpr unsigned kKeys = 2000;
  const std::vector<double> area(kCells, 1.0);
  const CellDealer dealer(area, kBits);
  const CellCode mine = deal_cells(test_key(2), area, kBits);
  CellCode other;
  std::vector<double> agreement(kCells);
  double same_bit = 0;
  for (unsigned k = 0; k < kKeys; ++k) {
    dealer.deal(derive_key(test_key(3), "test", k), other);
    for (std::size_t c = 0; c < agreement.size(); ++c) {
      agreement[c] += mine.sign[c] * other.sign[c];
      same_bit += mine.bit[c] == other.bit[c];
    }
  }
  for (double a : agreement) CHECK(std::abs(a) < 5 * std::sqrt(kKeys));
  const double expected = double{kKeys} * kCells / kBits;
  CHECK(std::abs(same_bit - expected) < 5 * std::sqrt(expected));
}

TEST_CASE("cell_code: a dealer's reused storage gives the same code as a fresh one") {
  const auto area = some_areas(100);
  const CellDealer dealer(area, 8);
  CellCode code;
  dealer.deal(test_key(9), code);
  const auto other_bits = code.bit;
  dealer.deal(test_key(4), code);
  const CellCode fresh = deal_cells(test_key(4), area, 8);
  CHECK(code.bit == fresh.bit);
  CHECK(code.sign == fresh.sign);
  CHECK_FALSE(other_bits == fresh.bit);
}

TEST_CASE("cell_code: measured strengths decide which cells share a bit, the key decides which bit it is") {
  // The first view shows the even cells, the second the odd ones; by area, cells 0 to 3 are one group.
  const std::vector<double> area{8, 7, 6, 5, 4, 3, 2, 1};
  std::vector<std::int32_t> strength(16);
  for (std::size_t c = 0; c < 8; ++c) strength[8 * (c % 2) + c] = static_cast<std::int32_t>(100 - c);
  const CellDealer dealer({std::span<const double>(area), strength}, 4);
  CellCode first, other;
  dealer.deal(test_key(1), first);
  bool another_bit = false;
  for (unsigned k = 0; k < 20; ++k) {
    dealer.deal(test_key(k), other);
    for (std::int32_t bit = 0; bit < 4; ++bit) {
      int even = 0, odd = 0;
      for (std::size_t c = 0; c < 8; ++c)
        if (other.bit[c] == bit) ++(c % 2 == 0 ? even : odd);
      CHECK((even == 1 && odd == 1));  // both views show every bit
    }
    for (std::size_t c = 0; c < 8; ++c) {
      another_bit = another_bit || other.bit[c] != first.bit[c];
      CHECK((other.bit[c] == other.bit[0]) == (first.bit[c] == first.bit[0]));
    }
    std::vector<std::int8_t> signs(8);
    keyed_signs(test_key(k), "fieldmark cell sign", signs);
    CHECK(other.sign == signs);
  }
  CHECK(another_bit);
}

TEST_CASE("cell_code: strengths that are not those of whole views, or negative, are refused") {
  const std::vector<double> area{3, 2, 1};
  const std::vector<std::int32_t> five(5, 1), negative{1, 1, -1};
  CHECK_THROWS_WITH(deal_cells(test_key(0), {std::span<const double>(area), five}, 1),
                    "[deal_cells] strength must have numbers for all of 3 cells in each view, got 5");
  CHECK_THROWS_WITH(deal_cells(test_key(0), {std::span<const double>(area), negative}, 1),
                    "[deal_cells] strength must be at least 0, got -1");
}

TEST_CASE("cell_code: the sign a cell shows for a message") {
  const CellCode code{{0, 1, -1, 1}, {1, 1, 0, -1}};
  CHECK(cell_signs(code, Message{{1, 0}}) == std::vector<std::int8_t>{1, -1, 0, 1});
  CHECK(cell_signs(code, Message{{0, 1}}) == std::vector<std::int8_t>{-1, 1, 0, -1});
  CHECK_THROWS_WITH(cell_signs(code, Message{{1}}),
                    "[cell_signs] code: the bit of cell 1 must be below 1 (the message's length), got 1");
}

TEST_CASE("cell_code: too few cells, bad areas and no bits are refused") {
  const std::vector<double> area{1, 0, 2};
  CHECK_THROWS_AS(deal_cells(test_key(0), area, 3), ValueError);
  CHECK_THROWS_WITH(
      deal_cells(test_key(0), area, 3),
      "[deal_cells] area: must have at least 3 cells of positive area (one for each bit), got 2");
  CHECK_THROWS_WITH(deal_cells(test_key(0), area, 0), "[deal_cells] n_bits must be at least 1, got 0");
  CHECK_THROWS_WITH(deal_cells(test_key(0), std::vector<double>{1, -2}, 1),
                    Contains("cell 1 must be finite and >= 0, got -2"));
  CHECK_THROWS_WITH(deal_cells(test_key(0), std::vector<double>{std::numeric_limits<double>::quiet_NaN()}, 1),
                    Contains("cell 0 must be finite and >= 0, got nan"));
}
