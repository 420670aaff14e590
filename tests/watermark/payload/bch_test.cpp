#include <fieldmark/core/error.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/watermark/payload/bch.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#include "support/catch.h"
#include "watermark/bits_of.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

using Bits = std::vector<std::uint8_t>;

unsigned value_of(const Bits& bits) {
  unsigned value = 0;
  for (std::uint8_t bit : bits) value = 2 * value + bit;
  return value;
}

// Returns all codewords as numbers.
std::vector<unsigned> codewords(const Bch& code) {
  std::vector<unsigned> words;
  for (unsigned i = 0; i < 1u << code.dimension(); ++i)
    words.push_back(value_of(code.encode(bits_of(i, code.dimension()))));
  return words;
}

Bits random_bits(Index n, const CounterRng& rng, std::uint64_t a) {
  Bits bits;
  for (Index i = 0; i < n; ++i)
    bits.push_back(static_cast<std::uint8_t>(rng.below(2, a, static_cast<std::uint64_t>(i))));
  return bits;
}

// Returns the word with `errors` different bits flipped.
Bits spoilt(Bits word, Index errors, const CounterRng& rng, std::uint64_t a) {
  const auto order = permutation(static_cast<Index>(word.size()), rng, a);
  for (Index i = 0; i < errors; ++i) word[static_cast<std::size_t>(order[static_cast<std::size_t>(i)])] ^= 1;
  return word;
}

}  // namespace

TEST_CASE("bch: parameters are those of the published table of primitive codes") {
  // Lin and Costello 2004, appendix C: n, k, t.
  const Index table[][3] = {{7, 4, 1},     {15, 11, 1},   {15, 7, 2},     {15, 5, 3},     {31, 26, 1},
                            {31, 21, 2},   {31, 16, 3},   {31, 11, 5},    {31, 6, 7},     {63, 57, 1},
                            {63, 45, 3},   {63, 39, 4},   {63, 36, 5},    {63, 30, 6},    {63, 24, 7},
                            {63, 18, 10},  {63, 16, 11},  {63, 10, 13},   {63, 7, 15},    {127, 120, 1},
                            {127, 71, 9},  {127, 64, 10}, {127, 50, 13},  {127, 43, 14},  {127, 36, 15},
                            {127, 29, 21}, {255, 247, 1}, {255, 139, 15}, {255, 131, 18}, {255, 71, 29},
                            {255, 45, 43}, {255, 37, 45}, {255, 29, 47},  {255, 21, 55}};
  for (const auto& [n, k, t] : table) {
    const int m = std::bit_width(static_cast<unsigned>(n));
    const Bch code(m, t, n);
    INFO("(" << n << ", " << k << ", " << t << ")");
    CHECK(code.dimension() == k);
    CHECK(code.corrects() == t);
    const auto strongest = Bch::strongest(m, n, k);
    REQUIRE(strongest);
    CHECK(strongest->corrects() == t);
  }
  CHECK(Bch(7, 8, 127).dimension() == 71);  // the generator for 8 errors corrects 9
  CHECK(Bch(7, 8, 127).corrects() == 9);
  CHECK(Bch(7, 9, 100).dimension() == 44);
  CHECK_FALSE(Bch::strongest(7, 100, 94));
}

TEST_CASE("bch: small codes have the distance they promise, and keep it when shortened") {
  const Index codes[][3] = {{3, 1, 7},  {3, 3, 7},  {4, 1, 15}, {4, 2, 15}, {4, 3, 15},
                            {4, 2, 12}, {5, 3, 31}, {5, 5, 31}, {5, 3, 24}, {6, 10, 60}};
  for (const auto& [m, t, n] : codes) {
    const Bch code(static_cast<int>(m), t, n);
    INFO("m " << m << ", t " << t << ", length " << n);
    REQUIRE(code.corrects() >= t);
    // In a linear code, the minimum distance is the minimum weight.
    Index least = n;
    for (unsigned i = 1; i < 1u << std::min<Index>(code.dimension(), 16); ++i) {
      const Bits word = code.encode(bits_of(i, code.dimension()));
      least = std::min(least, static_cast<Index>(std::count(word.begin(), word.end(), 1)));
    }
    CHECK(least >= 2 * code.corrects() + 1);
    if (n == (Index{1} << m) - 1) CHECK(least == 2 * code.corrects() + 1);
  }
}

TEST_CASE("bch: every word of a small code goes to its nearest codeword, or to none") {
  const Index codes[][3] = {{3, 1, 7}, {4, 2, 15}, {4, 3, 15}, {4, 2, 12}, {4, 1, 10}, {5, 3, 18}};
  for (const auto& [m, t, n] : codes) {
    const Bch code(static_cast<int>(m), t, n);
    const auto words = codewords(code);
    Index wrong = 0, near = 0;
    for (unsigned seen = 0; seen < 1u << n; ++seen) {
      unsigned nearest = 0;
      int distance = static_cast<int>(n) + 1;
      for (unsigned word : words)
        if (std::popcount(word ^ seen) < distance) distance = std::popcount((nearest = word) ^ seen);
      const auto found = code.decode(bits_of(seen, n));
      if (distance <= code.corrects()) {
        ++near;
        wrong += !found || found->corrected != distance || value_of(found->bits) != nearest;
      } else {
        wrong += found.has_value();
      }
    }
    INFO("m " << m << ", t " << t << ", length " << n);
    CHECK(wrong == 0);
    CHECK(near > 0);
  }
}

TEST_CASE("bch: random errors up to what is promised are corrected in long codes, shortened or not") {
  const Index codes[][3] = {{7, 8, 127}, {7, 9, 100}, {6, 5, 48}, {8, 15, 255}, {8, 43, 255}, {8, 20, 200}};
  const CounterRng rng(3);
  std::uint64_t place = 0;
  for (const auto& [m, t, n] : codes) {
    const Bch code(static_cast<int>(m), t, n);
    for (Index errors = 0; errors <= code.corrects(); ++errors)
      for (int trial = 0; trial < 8; ++trial) {
        const Bits information = random_bits(code.dimension(), rng, ++place);
        const Bits word = code.encode(information);
        CHECK(std::equal(information.begin(), information.end(), word.begin()));
        const auto found = code.decode(spoilt(word, errors, rng, ++place));
        REQUIRE(found);
        CHECK(found->bits == word);
        CHECK(found->corrected == errors);
      }
  }
}

TEST_CASE("bch: more errors give none, or another codeword that is near") {
  const Bch code(7, 8, 127);
  const CounterRng rng(4);
  Index none = 0, trials = 0;
  for (Index errors = code.corrects() + 1; errors < 60; ++errors)
    for (int trial = 0; trial < 10; ++trial, ++trials) {
      const auto place = static_cast<std::uint64_t>(errors * 100 + trial);
      const Bits word = code.encode(random_bits(code.dimension(), rng, place));
      const Bits seen = spoilt(word, errors, rng, place + 10000);
      const auto found = code.decode(seen);
      none += !found;
      if (!found) continue;
      CHECK(found->corrected <= code.corrects());
      CHECK(found->bits != word);
      const Bits again =
          code.encode(std::span(found->bits).first(static_cast<std::size_t>(code.dimension())));
      CHECK(again == found->bits);
    }
  CHECK(none > 0.99 * static_cast<double>(trials));  // chance: sum_(i<=9) C(127, i) / 2^56 = 2.7e-4
}

TEST_CASE("bch: as many random words are decoded as spheres around the codewords hold") {
  const Bch code(6, 3, 40);  // 22 bits of information
  double spheres = 0, binomial = 1;
  for (int i = 0; i <= 3; ++i) {
    spheres += binomial;
    binomial *= (40.0 - i) / (i + 1);
  }
  const double expected = spheres / 262144;  // 2^18
  const CounterRng rng(5);
  constexpr int kTrials = 40000;
  int decoded = 0;
  for (std::uint64_t i = 0; i < kTrials; ++i) decoded += code.decode(random_bits(40, rng, i)).has_value();
  const double deviation = std::sqrt(expected * (1 - expected) / kTrials);
  CHECK(std::abs(decoded / static_cast<double>(kTrials) - expected) < 4 * deviation);
}

TEST_CASE("bch: what is wrong is named") {
  CHECK_THROWS_WITH(Bch(2, 1, 3), "[Bch] m must be 3 to 8 (the fields that are built in), got 2");
  CHECK_THROWS_WITH(Bch(9, 1, 300), "[Bch] m must be 3 to 8 (the fields that are built in), got 9");
  CHECK_THROWS_WITH(Bch(4, 0, 15), "[Bch] t must be at least 1, got 0");
  CHECK_THROWS_WITH(Bch(4, 1, 16), "[Bch] length must be 1 to 15 (2^m - 1), got 16");
  CHECK_THROWS_WITH(Bch(4, 2, 8),
                    "[Bch] length must exceed the 8 check bits that correcting 2 errors takes, got 8");
  CHECK_THROWS_WITH(Bch::strongest(4, 15, 0), "[Bch] dimension must be at least 1, got 0");
  const Bch code(4, 2, 15);
  CHECK_THROWS_WITH(code.encode(Bits(8)), "[Bch::encode] word: must have 7 bits, got 8");
  CHECK_THROWS_WITH(code.decode(Bits(14)), "[Bch::decode] word: must have 15 bits, got 14");
  CHECK_THROWS_WITH(code.decode(Bits(15, 2)), "[Bch::decode] word: bit 0 must be 0 or 1, got 2");
}
