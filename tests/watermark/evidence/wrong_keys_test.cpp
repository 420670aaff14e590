#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/watermark/evidence/evidence.h>
#include <fieldmark/watermark/evidence/wrong_keys.h>
#include <fieldmark/watermark/keys/keyed_hash.h>
#include <fieldmark/watermark/mark/cell_code.h>

#include <cmath>

#include "support/catch.h"
#include "support/random.h"
#include "watermark/test_key.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
const std::vector<double> kArea(100, 1.0);
const Message kMessage{{1, 0, 1, 1, 0, 0, 1, 0}};
}  // namespace

TEST_CASE("wrong_keys: counts equal a plain loop over the same keys") {
  const auto evidence = uniform({100}, -1, 1, 2).data;
  const WrongKeyCounts counts = count_wrong_keys(evidence, kArea, kMessage, 1000, 258);
  Key root;
  root.bytes[0] = 2;  // 258 = 0x102, little-endian
  root.bytes[1] = 1;
  std::array<Index, 8> expected{};
  std::array<Index, 80> histogram{};
  double least = 1;
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const CellCode code = deal_cells(derive_key(root, "fieldmark wrong key", i), kArea, kMessage.size());
    const double t = keyed_statistic(evidence, code, kMessage), p = keyed_p_value(t);
    ++histogram[static_cast<std::size_t>(std::floor(4 * (t + 10)))];
    least = std::min(least, p);
    for (std::size_t k = 0; k < 8; ++k) expected[k] += std::log10(p) <= -1 - static_cast<double>(k);
  }
  CHECK(counts.n == 1000);
  CHECK(counts.counts == expected);
  CHECK(counts.histogram == histogram);
  CHECK(counts.least_p == least);
  CHECK(counts.counts[0] > 0);
}

TEST_CASE("wrong_keys: cells that are dealt by strength are tested so") {
  std::vector<std::int32_t> strength(2 * kArea.size());
  for (std::size_t i = 0; i < strength.size(); ++i) strength[i] = static_cast<std::int32_t>(i * 31 % 97);
  const CellWeights weights{std::span<const double>(kArea), strength};
  std::vector<double> evidence(kArea.size());
  for (std::size_t c = 0; c < evidence.size(); ++c) evidence[c] = std::sin(static_cast<double>(c * c));
  const auto least_of = [&](const CellWeights& w) {
    double least = 1;
    for (std::uint64_t i = 0; i < 50; ++i) {
      const Key key = derive_key(key_of_seed(9), "fieldmark wrong key", i);
      least = std::min(
          least, keyed_p_value(keyed_statistic(evidence, deal_cells(key, w, kMessage.size()), kMessage)));
    }
    return least;
  };
  CHECK(count_wrong_keys(evidence, weights, kMessage, 50, 9).least_p == least_of(weights));
  CHECK(least_of(weights) != least_of(kArea));
}

TEST_CASE("wrong_keys: a marked image stays within the binomial bound, for any number of threads") {
  const auto signs = cell_signs(deal_cells(test_key(0), kArea, kMessage.size()), kMessage);
  const std::vector<double> evidence(signs.begin(), signs.end());
  const ScopedThreads serial(1);
  const WrongKeyCounts one = count_wrong_keys(evidence, kArea, kMessage, 10000, 0);
  const ScopedThreads parallel(2);
  const WrongKeyCounts two = count_wrong_keys(evidence, kArea, kMessage, 10000, 0);
  CHECK(one == two);
  for (std::size_t k = 0; k < 8; ++k) {
    CHECK(one.counts[k] <= binomial_upper(10000, std::pow(10.0, -1 - static_cast<double>(k)), 0.9999));
  }
  CHECK_FALSE(count_wrong_keys(evidence, kArea, kMessage, 10000, 1).counts == one.counts);
}

TEST_CASE("wrong_keys: no keys, and arguments that make no sense") {
  const std::vector<double> evidence(100, 1.0);
  CHECK(count_wrong_keys(evidence, kArea, kMessage, 0, 0) == WrongKeyCounts{});
  CHECK_THROWS_WITH(count_wrong_keys(evidence, kArea, kMessage, -1, 0),
                    "[count_wrong_keys] n must be at least 0, got -1");
  CHECK_THROWS_WITH(count_wrong_keys(std::vector<double>(3), kArea, kMessage, 1, 0),
                    Contains("must have 100 entries"));
}

TEST_CASE("wrong_keys: progress is told after every round, and can stop the count") {
  const auto evidence = uniform({100}, -1, 1, 2).data;
  std::vector<Index> told;
  const auto counts = count_wrong_keys(evidence, kArea, kMessage, 10000, 7, [&](Index done, Index total) {
    CHECK(total == 10000);
    told.push_back(done);
    return true;
  });
  CHECK(told == std::vector<Index>{8192, 10000});
  CHECK(counts == count_wrong_keys(evidence, kArea, kMessage, 10000, 7));
  CHECK_THROWS_WITH(count_wrong_keys(evidence, kArea, kMessage, 10000, 7, [](Index, Index) { return false; }),
                    "[count_wrong_keys] stopped");
}

TEST_CASE("wrong_keys: a statistic counts in the bin that it begins") {
  // Evidence from one cell only: T is exactly 1 or -1.
  std::vector<double> evidence(100, 0.0);
  evidence[3] = 1;
  const auto counts = count_wrong_keys(evidence, kArea, kMessage, 500, 0);
  CHECK(counts.histogram[36] + counts.histogram[44] == 500);
}

TEST_CASE("wrong_keys: binomial interval, against exact fractions") {
  CHECK(binomial_interval(10, 0.5) == CountInterval{1, 9});  // this and the next four: Python's fractions
  CHECK(binomial_interval(1000, 0.1) == CountInterval{76, 125});
  CHECK(binomial_interval(1000, 1e-3) == CountInterval{0, 4});
  CHECK(binomial_interval(100, 0.999) == CountInterval{99, 100});
  CHECK(binomial_interval(1000, 0.5, 0.9) == CountInterval{474, 526});
  CHECK(binomial_interval(0, 0.5) == CountInterval{0, 0});
  CHECK(binomial_interval(1000000, 1e-8) == CountInterval{0, 1});
  CHECK_THROWS_AS(binomial_interval(10, -0.1), ValueError);
}

TEST_CASE("wrong_keys: binomial bound, against exact fractions and the normal limit") {
  CHECK(binomial_upper(10, 0.5) == 9);  // this and the next five: Python's fractions
  CHECK(binomial_upper(1000, 0.1) == 123);
  CHECK(binomial_upper(1000, 1e-3) == 4);
  CHECK(binomial_upper(100, 0.999) == 100);
  CHECK(binomial_upper(1, 1e-3) == 0);
  CHECK(binomial_upper(1000, 1e-8) == 0);
  CHECK(binomial_upper(1, 0.5, 0.5) == 0);
  CHECK(binomial_upper(1, 0.5, 0.51) == 1);
  CHECK(binomial_upper(10, 0) == 0);
  CHECK(binomial_upper(10, 1) == 10);
  CHECK(binomial_upper(0, 0.5) == 0);
  const double normal = 1e8 * 0.3 + 2.3263478740408408 * std::sqrt(1e8 * 0.3 * 0.7);
  CHECK(std::abs(static_cast<double>(binomial_upper(100000000, 0.3)) - normal) < 2);
  CHECK_THROWS_WITH(binomial_upper(-1, 0.5), "[binomial_upper] n must be at least 0, got -1");
  CHECK_THROWS_WITH(binomial_upper(1, 1.5), Contains("p must be in [0, 1], got 1.5"));
  CHECK_THROWS_WITH(binomial_upper(1, 0.5, 1), Contains("level must be in (0, 1), got 1"));
}

TEST_CASE("wrong_keys: counts add up, statistic by statistic and sum by sum") {
  WrongKeyCounts one, two;
  for (const double t : {0.0, 2.5, 4.0}) one.add(t);  // p 1, 0.044, 3.4e-4
  two.add(-30.0);                                     // p 1, below the histogram
  two.add(7.0);                                       // p 2.3e-11
  CHECK(one.n == 3);
  CHECK(one.counts == std::array<Index, 8>{2, 1, 1, 0, 0, 0, 0, 0});
  CHECK(one.least_p == std::exp(-8.0));
  CHECK(one.histogram[40] == 1);
  CHECK(one.histogram[50] == 1);
  one.add(two);
  CHECK(one.n == 5);
  CHECK(one.counts == std::array<Index, 8>{3, 2, 2, 1, 1, 1, 1, 1});
  CHECK(one.least_p == std::exp(-24.5));
  CHECK(one.histogram[0] == 1);
  CHECK_THROWS_AS(one.add(std::nan("")), ValueError);
}
