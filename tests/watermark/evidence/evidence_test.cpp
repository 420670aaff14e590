#include <fieldmark/core/error.h>
#include <fieldmark/watermark/evidence/evidence.h>
#include <fieldmark/watermark/keys/keyed_hash.h>

#include <cmath>
#include <limits>
#include <set>

#include "support/catch.h"
#include "support/random.h"
#include "support/worst.h"
#include "watermark/test_key.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Cells 0, 2 and 3 carry bit 0; cells 1 and 5 carry bit 1; cell 6 carries bit 2; cell 4 nothing.
const CellCode kCode{{0, 1, 0, 0, -1, 1, 2}, {1, -1, -1, 1, 0, 1, 1}};
const std::vector<double> kEvidence{3, 1, -2, 0.5, 100, -1, 0};

// Returns P(X >= k) from Pascal's triangle in long double, with each row halved on the way.
long double tail(Index k, Index n) {
  std::vector<long double> row{1};
  for (Index i = 0; i < n; ++i) {
    row.push_back(0);
    for (std::size_t j = row.size(); j-- > 0;) row[j] = (row[j] + (j > 0 ? row[j - 1] : 0)) / 2;
  }
  long double sum = 0;
  for (Index j = n; j >= k; --j) sum += row[static_cast<std::size_t>(j)];
  return sum;
}

// Returns the evidence of images that resemble a mark as little as possible.
std::vector<std::vector<double>> adversarial_evidence(std::size_t cells) {
  std::vector<std::vector<double>> images(5, std::vector<double>(cells, 0.0));
  images[0][17] = 5;             // one-hot
  images[1].assign(cells, 1.0);  // an extractor that always says "one"
  for (std::size_t c = 0; c < cells; ++c) {
    images[2][c] = 1 / static_cast<double>((c + 1) * (c + 1));  // heavy tail
    images[3][c] = c < 4 ? 1 : 1e-3;                            // four cells outweigh the rest
  }
  images[4] = uniform({static_cast<Index>(cells)}, -1, 1, 3).data;
  return images;
}
}  // namespace

TEST_CASE("evidence: statistic and p-value by hand, at any scale") {
  // For message 01x bit 0 flips the signs and bit 1 keeps them: -1 -1 +1 -1 . +1, and cell 6 has no evidence.
  const double expected = (-3 - 1 - 2 - 0.5 - 1) / std::sqrt(9 + 1 + 4 + 0.25 + 1);
  for (double scale : {1.0, 1e-300, 1e300}) {
    auto evidence = kEvidence;
    for (double& s : evidence) s *= scale;
    CHECK(keyed_statistic(evidence, kCode, Message{{0, 1, 0}}) == Approx(expected).epsilon(1e-15));
    CHECK(keyed_statistic(evidence, kCode, Message{{1, 0, 1}}) == Approx(-expected).epsilon(1e-15));
  }
  CHECK(keyed_statistic(std::vector<double>(7), kCode, Message{{0, 1, 0}}) == 0);
  CHECK(keyed_p_value(2) == Approx(std::exp(-2.0)).epsilon(1e-15));
  CHECK(keyed_p_value(0) == 1);
  CHECK(keyed_p_value(-5) == 1);
  CHECK(keyed_p_value(60) == std::numeric_limits<double>::min());
  CHECK(sharp_p_value(0) == 1);
  CHECK(sharp_p_value(-5) == 1);
  CHECK(sharp_p_value(0.5) == keyed_p_value(0.5));
  CHECK(sharp_p_value(2) == Approx(0.02275013194817921 / (4 * 0.07864960352514258)).epsilon(1e-14));
  CHECK(sharp_p_value(7) == Approx(1.279812543885835e-12 / (4 * 0.07864960352514258)).epsilon(1e-13));
  CHECK(sharp_p_value(60) == std::numeric_limits<double>::min());
  CHECK_THROWS_AS(sharp_p_value(std::numeric_limits<double>::quiet_NaN()), ValueError);
  CHECK(keyed_p_value_two_sided(-3) == Approx(2 * std::exp(-4.5)).epsilon(1e-15));
  CHECK(keyed_p_value_two_sided(0.5) == 1);
}

TEST_CASE("evidence: the least p is reached by the evidence that agrees everywhere") {
  std::vector<double> evidence{2, 2, 2, 2, -9, 2, 2};
  const Message message{{1, 0, 1}};
  const auto signs = cell_signs(kCode, message);
  for (std::size_t c = 0; c < evidence.size(); ++c) evidence[c] *= signs[c];
  CHECK(keyed_p_value(keyed_statistic(evidence, kCode, message)) ==
        Approx(least_p(kCode.carriers())).epsilon(1e-14));
  CHECK(least_p(evidence, kCode) == Approx(std::exp(-3.0)).epsilon(1e-14));
  CHECK(least_p(kEvidence, kCode) == Approx(std::exp(-0.5 * 7.5 * 7.5 / 15.25)).epsilon(1e-14));
  CHECK(least_p(std::vector<double>(7), kCode) == 1);
  CHECK(least_p(0) == 1);
  CHECK(least_p(100000) == std::numeric_limits<double>::min());
  CHECK_THROWS_WITH(least_p(-1), "[least_p] carriers must be at least 0, got -1");
}

TEST_CASE("evidence: under random keys small p-values are as rare as they should be, whatever the image") {
  constexpr Index kCells = 200;
  constexpr unsigned kKeys = 4000;
  const CellDealer dealer(std::vector<double>(kCells, 1.0), 16);
  const Message message = message_from_hex("ff0a", 16);
  CellCode code;
  const auto images = adversarial_evidence(kCells);
  for (std::size_t image = 0; image < images.size(); ++image) {
    CAPTURE(image);
    const auto& evidence = images[image];
    std::array<int, 3> one_sided{}, two_sided{};
    std::set<double> statistics;
    for (unsigned k = 0; k < kKeys; ++k) {
      dealer.deal(derive_key(test_key(0), "null", k), code);
      const double t = keyed_statistic(evidence, code, message);
      statistics.insert(t);
      double level = 0.1;
      for (std::size_t i = 0; i < 3; ++i, level /= 10) {
        one_sided[i] += keyed_p_value(t) <= level;
        two_sided[i] += keyed_p_value_two_sided(t) <= level;
      }
    }
    CHECK(statistics.size() >= 2);  // the keys deal differently: even one cell has either sign
    // Where no cell outweighs the others, T is nearly normal: exp(-T^2 / 2) <= 0.1 for 1.6% of 4000 keys, 64.
    if (image == 1 || image == 4) CHECK(one_sided[0] > 32);
    double mean = kKeys * 0.1;
    for (std::size_t i = 0; i < 3; ++i, mean /= 10) {
      CHECK(one_sided[i] <= mean + 4 * std::sqrt(mean));
      CHECK(two_sided[i] <= mean + 4 * std::sqrt(mean));
    }
  }
}

// Every sum of at most 14 signs with weights of one power law, against all its 2^n signs. Two equal weights
// reach the bound: P(T >= sqrt 2) = 1/4.
TEST_CASE("evidence: the sharp p-value bounds the exact tail of every sum of signs") {
  double nearest = 0;
  for (unsigned n = 1; n <= 14; ++n)
    for (const double power : {0.0, 0.5, 1.0, 2.0}) {
      std::vector<double> weight(n), sums;
      double squares = 0;
      for (unsigned c = 0; c < n; ++c) {
        weight[c] = std::pow(c + 1.0, -power);
        squares += weight[c] * weight[c];
      }
      for (unsigned signs = 0; signs < 1u << n; ++signs) {
        double sum = 0;
        for (unsigned c = 0; c < n; ++c) sum += (signs >> c & 1u) ? weight[c] : -weight[c];
        sums.push_back(sum / std::sqrt(squares));
      }
      std::sort(sums.begin(), sums.end(), std::greater<>());
      for (std::size_t i = 0; i < sums.size(); ++i) {
        const double tail = static_cast<double>(i + 1) / static_cast<double>(sums.size());
        raise_to(nearest, tail / sharp_p_value(sums[i] * (1 - 1e-14)));
      }
    }
  CHECK(nearest <= 1);
  CHECK(nearest > 0.999);
}

TEST_CASE("evidence: bits are read with their signs, and a bit without evidence is half right") {
  const BitReading reading = read_bits(kEvidence, kCode, 4);
  CHECK(reading.logit[0] == Approx((3 + 2 + 0.5) / std::sqrt(9 + 4 + 0.25)).epsilon(1e-15));
  CHECK(reading.logit[1] == Approx(-2 / std::sqrt(2.0)).epsilon(1e-15));
  CHECK(reading.logit[2] == 0);
  CHECK(reading.logit[3] == 0);
  const double largest = 3;
  CHECK(reading.sum[0] == Approx((3 + 2 + 0.5) / largest).epsilon(1e-15));
  CHECK(reading.sum[1] == Approx(-2 / largest).epsilon(1e-15));
  CHECK(reading.sum[2] == 0);
  CHECK(reading.sum[3] == 0);
  CHECK(reading.message.bits == std::vector<std::uint8_t>{1, 0, 0, 0});
  CHECK(reading.decided == std::vector<std::uint8_t>{1, 1, 0, 0});
  const BitMatch match = match_bits(reading, Message{{1, 1, 0, 1}});
  CHECK(match.matching == 1);
  CHECK(match.decided == 2);
  CHECK(match.bits == 4);
  CHECK(match.accuracy() == 0.5);
  CHECK(match_bits(reading, Message{{1, 0, 0, 1}}).accuracy() == 0.75);
}

TEST_CASE("evidence: marked cells are read back under the key, and are noise under another") {
  constexpr Index kCells = 600, kBits = 48;
  const std::vector<double> area(kCells, 1.0);
  const Message message = random_message(kBits, CounterRng(1), 0);
  const CellCode code = deal_cells(test_key(0), area, kBits);
  const auto signs = cell_signs(code, message);
  auto evidence = uniform({kCells}, -1, 1, 8).data;
  for (std::size_t c = 0; c < evidence.size(); ++c) evidence[c] += signs[c];
  CHECK(match_bits(read_bits(evidence, code, kBits), message).matching == kBits);
  CHECK(keyed_p_value(keyed_statistic(evidence, code, message)) < 1e-80);
  const CellCode wrong = deal_cells(test_key(1), area, kBits);
  CHECK(keyed_p_value(keyed_statistic(evidence, wrong, message)) > 1e-4);
  const BitMatch match = match_bits(read_bits(evidence, wrong, kBits), message);
  CHECK(p_value_bits_two_sided(match.matching, match.decided) > 1e-4);
}

TEST_CASE("evidence: p-value of matching bits, against Pascal's triangle and exact fractions") {
  double worst = 0;
  for (Index n : {0, 1, 2, 7, 16, 48, 64, 255}) {
    for (Index k = 0; k <= n; ++k) {
      raise_to(worst, std::abs(p_value_bits(k, n) / static_cast<double>(tail(k, n)) - 1));
      const auto both = 2 * k == n ? 1.0 : static_cast<double>(2 * tail(std::max(k, n - k), n));
      raise_to(worst, std::abs(p_value_bits_two_sided(k, n) / both - 1));
    }
  }
  CHECK(worst < 1e-15);
  CHECK(p_value_bits(600, 1000) == Approx(1.3642320780330092e-10).epsilon(1e-15));  // Python's fractions
  CHECK(p_value_bits(4, 33) == Approx(0.9999992994125932).epsilon(1e-15));
  CHECK(p_value_bits(5000, 5000) == std::numeric_limits<double>::min());
  // P(X >= n/2) = 1/2 + C(n, n/2) / 2^(n+1), Stirling to 1/n
  const double middle = (1 - 1 / 80000.0) / std::sqrt(std::acos(-1.0) * 10000);
  CHECK(p_value_bits(10000, 20000) == Approx(0.5 + 0.5 * middle).epsilon(1e-10));
  CHECK_THROWS_WITH(p_value_bits(5, 4), "[p_value_bits] matching: must be from 0 to n = 4, got 5");
  CHECK_THROWS_WITH(p_value_bits_two_sided(-1, 4),
                    "[p_value_bits_two_sided] matching: must be from 0 to n = 4, got -1");
}

TEST_CASE("evidence: least matching bits for a rate of false alarms") {
  struct Row {
    Index bits, at_1e3, at_1e6, at_1e9;
  };
  for (const Row& row : {Row{8, 9, 9, 9}, Row{16, 15, 17, 17}, Row{32, 26, 30, 32}, Row{48, 36, 41, 44},
                         Row{64, 45, 51, 56}}) {
    INFO(row.bits << " bits");
    CHECK(least_matching_bits(row.bits, 1e-3) == row.at_1e3);
    CHECK(least_matching_bits(row.bits, 1e-6) == row.at_1e6);
    CHECK(least_matching_bits(row.bits, 1e-9) == row.at_1e9);
  }
  CHECK(least_matching_bits(10, 1) == 0);
  CHECK(least_matching_bits(0, 0.5) == 1);
  CHECK_THROWS_WITH(least_matching_bits(8, 0), Contains("rate must be in (0, 1], got 0"));
  CHECK_THROWS_WITH(least_matching_bits(-1, 0.1), "[least_matching_bits] n must be at least 0, got -1");
}

TEST_CASE("evidence: sizes and values that make no sense are refused") {
  const std::vector<double> three(3), infinite{0, 0, kInfinity, 0, 0, 0, 0};
  CHECK_THROWS_AS(keyed_statistic(three, kCode, Message{{0, 1, 0}}), ValueError);
  CHECK_THROWS_WITH(keyed_statistic(three, kCode, Message{{0, 1, 0}}),
                    "[keyed_statistic] evidence: must have 7 entries (the cells of the code), got 3");
  CHECK_THROWS_WITH(read_bits(infinite, kCode, 3), "[read_bits] evidence: entry 2 must be finite, got inf");
  CHECK_THROWS_WITH(read_bits(kEvidence, kCode, 2),
                    "[read_bits] code: the bit of cell 6 must be below n_bits = 2, got 2");
  CHECK_THROWS_WITH(read_bits(kEvidence, kCode, 0), "[read_bits] n_bits must be at least 1, got 0");
  CHECK_THROWS_WITH(keyed_statistic(kEvidence, kCode, Message{{1}}), Contains("the message's length"));
  CHECK_THROWS_WITH(match_bits(read_bits(kEvidence, kCode, 3), Message{{1}}),
                    "[match_bits] reading: must have 1 bits (the message's length), got 3");
  CHECK_THROWS_WITH(keyed_p_value(kInfinity - kInfinity),
                    "[keyed_p_value] statistic must be a number, got nan");
}

namespace {
// Eight cells, two for each of four bits; the last bit of the message reads wrong, the third not at all.
const CellCode kScoreCode{{0, 0, 1, 1, 2, 2, 3, 3}, {1, -1, 1, -1, 1, -1, 1, -1}};
const Message kScoreMessage{{1, 0, 1, 0}};
const std::vector<double> kScoreEvidence{2, -1, -2, 2, 0, 0, 1, 0};
}  // namespace

TEST_CASE("evidence: score, every figure, by hand") {
  const EvidenceScore score = score_evidence(kScoreEvidence, kScoreCode, kScoreMessage);
  // sum S_c s_c = 2 + 1 + 2 + 2 - 1 = 6, sum S_c^2 = 4 + 1 + 4 + 4 + 1 = 14
  const double t = 6 / std::sqrt(14.);
  CHECK(score.statistic == Approx(t));
  CHECK(score.p_value == Approx(std::exp(-t * t / 2)));
  CHECK(score.p_value_two_sided == Approx(2 * std::exp(-t * t / 2)));
  CHECK(score.reading.message == Message{{1, 0, 0, 1}});
  CHECK(score.match.matching == 2);
  CHECK(score.match.decided == 3);
  CHECK(score.p_value_bits == Approx(0.5));  // 4 of the 8 outcomes of three coins
  CHECK(score.p_value_bits_two_sided == Approx(1));
}

TEST_CASE("evidence: score, the p-value of a bit falls with its logit") {
  const auto p = bit_p_values(score_evidence(kScoreEvidence, kScoreCode, kScoreMessage).reading);
  REQUIRE(p.size() == 4);
  CHECK(p[0] == Approx(2 * std::exp(-0.9)));  // L = 3 / sqrt 5
  CHECK(p[1] == Approx(2 * std::exp(-1.0)));  // L = -4 / sqrt 8
  CHECK(p[2] == 1);
  CHECK(p[3] == 1);
}

TEST_CASE("evidence: bits contradict a message where they are clear and differ") {
  BitReading reading;
  reading.message = {{1, 0, 1, 0}};
  reading.logit = {4, -4, 3, 0};
  reading.decided = {1, 1, 1, 0};
  // 2 exp(-4^2 / 2) = 6.7e-4 and 2 exp(-3^2 / 2) = 0.022, against 0.01 / 4
  CHECK(contradicting_bits(reading, {{1, 0, 1, 1}}) == 0);
  CHECK(contradicting_bits(reading, {{0, 0, 1, 0}}) == 1);
  CHECK(contradicting_bits(reading, {{0, 1, 0, 1}}) == 2);
  CHECK_THROWS_WITH(contradicting_bits(reading, {{1, 0}}), Contains("must have the 4 bits of the reading"));
}

TEST_CASE("evidence: score, sizes that do not fit are named") {
  CHECK_THROWS_WITH(score_evidence(std::vector<double>(3), kScoreCode, kScoreMessage),
                    Contains("must have 8 entries"));
}
