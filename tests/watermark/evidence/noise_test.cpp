#include <fieldmark/core/error.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/watermark/evidence/noise.h>
#include <fieldmark/watermark/evidence/wrong_keys.h>

#include <cmath>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
BitReading reading_of(std::vector<double> logits) {
  return {.logit = std::move(logits), .sum = {}, .message = {}, .decided = {}};
}
}  // namespace

TEST_CASE("noise: the p-value by hand, and the least that cells allow") {
  CHECK(noise_p_value(reading_of({2, -1, 2, 0})) == Approx(std::pow(9 / 4., 2) * std::exp((4 - 9) / 2.)));
  CHECK(noise_p_value(reading_of({1, -1, 0.5})) == 1);
  CHECK(noise_p_value(reading_of({1e200})) > 0);
  CHECK(noise_p_value(reading_of({100})) > 0);
  CHECK(noise_p_value(reading_of({-3})) == Approx(3 * std::exp(-4.)));
  CHECK(least_noise_p(8, 4) == Approx(4 * std::exp(-2.)));
  CHECK(least_noise_p(3, 4) == 1);
  CHECK_THROWS_AS(least_noise_p(8, 0), ValueError);
  CHECK_THROWS_AS(least_noise_p(-1, 4), ValueError);
}

// Few cells per bit, one of which outweighs the others; and many equal cells.
TEST_CASE("noise: keys reach a p-value no more often than it says, whatever the evidence") {
  constexpr Index kBits = 6, kKeys = 10000;
  for (const Index cells : {12, 96}) {
    std::vector<double> evidence(static_cast<std::size_t>(cells), 1.0);
    for (std::size_t c = 0; c < evidence.size(); c += 5) evidence[c] = 3;
    const CellDealer dealer(evidence, kBits);
    const CounterRng rng(9);
    CellCode code;
    Index counts[3] = {};
    for (Index k = 0; k < kKeys; ++k) {
      Key key;
      for (std::size_t i = 0; i < key.bytes.size(); ++i)
        key.bytes[i] = static_cast<std::uint8_t>(rng.bits(static_cast<std::uint64_t>(k), i / 4)[i % 4]);
      dealer.deal(key, code);
      const double p = noise_p_value(read_bits(evidence, code, kBits));
      for (int i = 0; i < 3; ++i) counts[i] += p <= std::pow(10.0, -i - 1);
    }
    INFO(cells << " cells: " << counts[0] << ", " << counts[1] << ", " << counts[2]);
    for (int i = 0; i < 3; ++i) CHECK(counts[i] <= binomial_upper(kKeys, std::pow(10.0, -i - 1)));
    if (cells == 96) CHECK(counts[0] > 20);
  }
}

// 16 bits of 8 cells each; every cell shows its bit with one of ten signs wrong.
TEST_CASE("noise: a reading of a message stands out") {
  const std::vector<double> area(128, 1.0);
  const CellCode code = deal_cells({}, area, 16);
  const Message message{{1, 0, 1, 1, 0, 0, 1, 0, 1, 0, 0, 0, 1, 1, 1, 0}};
  const auto signs = cell_signs(code, message);
  std::vector<double> evidence(signs.begin(), signs.end());
  for (std::size_t c = 0; c < evidence.size(); c += 10) evidence[c] = -evidence[c];
  const BitReading reading = read_bits(evidence, code, 16);
  CHECK(noise_p_value(reading) < 1e-9);
  CHECK(noise_p_value(reading) >= least_noise_p(128, 16));
}
