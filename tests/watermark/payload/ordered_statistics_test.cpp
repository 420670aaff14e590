#include <fieldmark/core/error.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/watermark/payload/bch.h>
#include <fieldmark/watermark/payload/ordered_statistics.h>

#include <limits>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

using Bits = std::vector<std::uint8_t>;

std::vector<Bits> generator_of(const Bch& code) {
  std::vector<Bits> rows;
  for (Index i = 0; i < code.dimension(); ++i) {
    Bits information(static_cast<std::size_t>(code.dimension()), 0);
    information[static_cast<std::size_t>(i)] = 1;
    rows.push_back(code.encode(information));
  }
  return rows;
}

double agreement(const Bits& word, const std::vector<double>& logits) {
  double sum = 0;
  for (std::size_t i = 0; i < word.size(); ++i) sum += word[i] ? logits[i] : -logits[i];
  return sum;
}

// Returns the logits of a word with noise: mean +-strength, standard deviation 1.
std::vector<double> seen(const Bits& word, double mark_psnr, const CounterRng& rng, std::uint64_t a) {
  std::vector<double> logits;
  for (std::size_t i = 0; i < word.size(); ++i)
    logits.push_back((word[i] ? mark_psnr : -mark_psnr) + static_cast<double>(rng.normal2(a, i)[0]));
  return logits;
}

}  // namespace

TEST_CASE("ordered_statistics: the best codeword of a small code is found, as by trying all of them") {
  const Bch code(4, 2, 15);  // 7 bits of information
  const OrderedStatistics decoder(generator_of(code));
  std::vector<Bits> words;
  for (unsigned i = 0; i < 128; ++i) {
    Bits information;
    for (int b = 6; b >= 0; --b) information.push_back(static_cast<std::uint8_t>((i >> b) & 1));
    words.push_back(code.encode(information));
  }
  const CounterRng rng(1);
  int better_by_order[4] = {};
  for (std::uint64_t trial = 0; trial < 300; ++trial) {
    const auto logits = seen(words[trial % 128], 0.5, rng, trial);
    double most = -1e9;
    for (const Bits& word : words) most = std::max(most, agreement(word, logits));
    for (int order = 0; order <= 3; ++order)
      better_by_order[order] += agreement(decoder.nearest(logits, order), logits) < most - 1e-12;
  }
  CHECK(better_by_order[3] == 0);
  CHECK(better_by_order[2] <= 2);
  CHECK(better_by_order[0] > 30);  // signs of the most reliable bits alone: a missing search would show
}

TEST_CASE(
    "ordered_statistics: erasures beyond what signs can bear are filled in, and each bit may be the lost "
    "one") {
  const Bch code(7, 9, 100);
  const OrderedStatistics decoder(generator_of(code));
  const CounterRng rng(2);
  for (std::uint64_t trial = 0; trial < 20; ++trial) {
    Bits information;
    for (std::uint64_t i = 0; i < 44; ++i)
      information.push_back(static_cast<std::uint8_t>(rng.below(2, trial, i)));
    const Bits word = code.encode(information);
    std::vector<double> logits;
    for (std::uint8_t bit : word) logits.push_back(bit ? 1.0 : -1.0);
    const auto order = permutation(100, rng, trial + 100);
    for (std::size_t i = 0; i < 18; ++i) logits[static_cast<std::size_t>(order[i])] = 0;
    CHECK(decoder.nearest(logits, 0) == word);  // 18 erasures: one less than the code's distance
    logits[static_cast<std::size_t>(order[50])] *= -1;
    CHECK(decoder.nearest(logits, 2) == word);
  }
}

TEST_CASE("ordered_statistics: strengths bring back words that signs alone cannot") {
  const Bch code(7, 9, 100);
  const OrderedStatistics decoder(generator_of(code));
  const CounterRng rng(3);
  const Bits word = code.encode(Bits(44, 1));
  int hard = 0, soft = 0;
  for (std::uint64_t trial = 0; trial < 60; ++trial) {
    const auto logits = seen(word, 1.3, rng, trial);  // 10% of the bits wrong
    Bits signs;
    for (double x : logits) signs.push_back(x > 0);
    const auto found = code.decode(signs);
    hard += found && found->bits == word;
    soft += decoder.nearest(logits, 2) == word;
  }
  CHECK(hard < 45);
  CHECK(soft > 55);
}

TEST_CASE("ordered_statistics: what is wrong is named") {
  CHECK_THROWS_WITH(OrderedStatistics({}),
                    "[OrderedStatistics] generator: words must have 1 to 256 bits, got 0");
  CHECK_THROWS_WITH(OrderedStatistics({Bits(257, 1)}),
                    "[OrderedStatistics] generator: words must have 1 to 256 bits, got 257");
  CHECK_THROWS_WITH(OrderedStatistics({Bits(3, 1), Bits(4, 1)}),
                    "[OrderedStatistics] generator: words must have one length, got 3 and 4");
  CHECK_THROWS_WITH(
      OrderedStatistics({Bits{1, 1, 0}, Bits{0, 1, 1}, Bits{1, 0, 1}}),
      "[OrderedStatistics] generator: the 3 words must be linearly independent, got 2 that are");
  const OrderedStatistics decoder({Bits{1, 1, 1}});
  const double one[] = {1, 1, 1}, bad[] = {1, std::numeric_limits<double>::quiet_NaN(), 1};
  CHECK_THROWS_WITH(decoder.nearest(std::span(one).first(2), 1),
                    "[OrderedStatistics::nearest] logits: must be 3, got 2");
  CHECK_THROWS_WITH(decoder.nearest(bad, 1), "[OrderedStatistics::nearest] logits must be finite");
  CHECK_THROWS_WITH(decoder.nearest(one, 4), "[OrderedStatistics::nearest] order must be 0 to 3, got 4");
}
