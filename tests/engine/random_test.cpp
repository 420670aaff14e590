#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/random.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <vector>

#include "support/catch.h"

using namespace fieldmark;
using Words = std::array<std::uint32_t, 4>;

namespace {
constexpr int kMany = 200000;

struct Moments {
  double mean = 0, variance = 0, skew = 0, kurtosis = 0;
};
Moments moments(const std::vector<double>& x) {
  Moments m;
  const double n = static_cast<double>(x.size());
  for (double v : x) m.mean += v / n;
  for (double v : x) m.variance += (v - m.mean) * (v - m.mean) / n;
  for (double v : x) m.skew += std::pow(v - m.mean, 3) / (n * std::pow(m.variance, 1.5));
  for (double v : x) m.kurtosis += std::pow(v - m.mean, 4) / (n * m.variance * m.variance);
  return m;
}
double correlation(const std::vector<double>& x, const std::vector<double>& y) {
  const Moments a = moments(x), b = moments(y);
  double sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += (x[i] - a.mean) * (y[i] - b.mean);
  return sum / (static_cast<double>(x.size()) * std::sqrt(a.variance * b.variance));
}
}  // namespace

// Test vectors of Philox4x32-10 that its authors publish with Random123.
TEST_CASE("random: stream 0 is Philox4x32-10 with the seed as key") {
  CHECK(CounterRng(0).bits(0, 0) == Words{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8});
  const std::uint64_t ones = ~std::uint64_t{0};
  CHECK(CounterRng(ones).bits(ones, ones) == Words{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd});
  CHECK(CounterRng(0x299f31d0a4093822).bits(0x85a308d3243f6a88, 0x0370734413198a2e) ==
        Words{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1});
}

TEST_CASE("random: uniform numbers stay from 0 to below 1 and have uniform moments in every word") {
  const CounterRng rng(7, 3);
  for (std::size_t word = 0; word < 4; ++word) {
    std::vector<double> x;
    for (std::uint64_t i = 0; i < kMany; ++i) x.push_back(rng.uniform4(5, i)[word]);
    CHECK(*std::min_element(x.begin(), x.end()) >= 0);
    CHECK(*std::max_element(x.begin(), x.end()) < 1);
    const Moments m = moments(x);
    // Four standard errors: sqrt(1/12 / n) = 6.5e-4 and sqrt(1/180 / n) = 1.7e-4.
    CHECK(std::abs(m.mean - 0.5) < 4 * 6.5e-4);
    CHECK(std::abs(m.variance - 1.0 / 12) < 4 * 1.7e-4);
  }
  CHECK(rng.uniform(5, 9) == rng.uniform4(5, 9)[0]);
}

TEST_CASE("random: a double carries 53 bits of the first two words") {
  const CounterRng rng(1);
  const auto w = rng.bits(2, 3);
  const double want =
      std::ldexp(static_cast<double>(w[1]), -32) + std::ldexp(static_cast<double>(w[0] >> 11), -53);
  CHECK(rng.uniform_double(2, 3) == want);
}

TEST_CASE("random: normal numbers have normal moments and are uncorrelated") {
  const CounterRng rng(11);
  std::vector<double> x, y, z, t;
  for (std::uint64_t i = 0; i < kMany; ++i) {
    const auto v = rng.normal4(i);
    x.push_back(v[0]);
    y.push_back(v[1]);
    z.push_back(v[2]);
    t.push_back(v[3]);
  }
  for (const auto* s : {&x, &y, &z, &t}) {
    const Moments m = moments(*s);
    // Four standard errors of each moment of n normal numbers: sqrt(1, 2, 6, 24 / n).
    CHECK(std::abs(m.mean) < 4 * std::sqrt(1.0 / kMany));
    CHECK(std::abs(m.variance - 1) < 4 * std::sqrt(2.0 / kMany));
    CHECK(std::abs(m.skew) < 4 * std::sqrt(6.0 / kMany));
    CHECK(std::abs(m.kurtosis - 3) < 4 * std::sqrt(24.0 / kMany));
  }
  CHECK(std::abs(correlation(x, y)) < 4 / std::sqrt(kMany));
  CHECK(std::abs(correlation(y, z)) < 4 / std::sqrt(kMany));
  CHECK(rng.normal2(42)[0] == rng.normal4(42)[0]);
  CHECK(rng.normal2(42)[1] == rng.normal4(42)[1]);
}

TEST_CASE("random: seeds, streams, a and b all give unrelated numbers") {
  const CounterRng base(5), other_seed(6), other_stream(5, 1), third_stream(5, 2);
  std::vector<double> u, seed, stream, third, shifted, swapped;
  for (std::uint64_t i = 0; i < kMany; ++i) {
    u.push_back(base.uniform(i));
    seed.push_back(other_seed.uniform(i));
    stream.push_back(other_stream.uniform(i));
    third.push_back(third_stream.uniform(i));
    shifted.push_back(base.uniform(i, 1));
    swapped.push_back(base.uniform(1, i));
  }
  for (const auto* s : {&seed, &stream, &third, &shifted, &swapped})
    CHECK(std::abs(correlation(u, *s)) < 4 / std::sqrt(kMany));
  CHECK(std::abs(correlation(stream, third)) < 4 / std::sqrt(kMany));
}

TEST_CASE("random: below is uniform, exact beyond 32 bits, and refuses an empty range") {
  const CounterRng rng(3);
  std::vector<int> counts(7);
  for (std::uint64_t i = 0; i < 70000; ++i) ++counts[static_cast<std::size_t>(rng.below(7, i))];
  // Four standard deviations of a binomial count: sqrt(70000 * 6 / 49) = 92.6.
  for (int c : counts) CHECK(std::abs(c - 10000) < 4 * 92.6);
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const auto w = rng.bits(i);
    const Index n = (Index{1} << 40) + 12345;
    const long double x = static_cast<long double>(w[0] | static_cast<std::uint64_t>(w[1]) << 32);
    // A long double has 64 bits: rounding affects the quotient's fraction, and its whole part only at odds of
    // 2^-24.
    const auto want = static_cast<Index>(std::floor(std::ldexp(x * static_cast<long double>(n), -64)));
    CHECK(std::abs(rng.below(n, i) - want) <= 1);
    CHECK(rng.below(1, i) == 0);
  }
  CHECK_THROWS_WITH(rng.below(0, 1), "[CounterRng::below] n must be at least 1, got 0");
}

TEST_CASE("random: a permutation holds every number once, and places are uniform") {
  const CounterRng rng(9);
  std::vector<int> first(5);
  for (std::uint64_t a = 0; a < 5000; ++a) {
    auto p = permutation(5, rng, a);
    ++first[static_cast<std::size_t>(p[0])];
    std::sort(p.begin(), p.end());
    CHECK(p == std::vector<Index>{0, 1, 2, 3, 4});
  }
  for (int c : first) CHECK(std::abs(c - 1000) < 4 * 28.3);
  CHECK(permutation(0, rng, 0).empty());
  CHECK(permutation(1, rng, 0) == std::vector<Index>{0});
  CHECK(permutation(100, rng, 1) != permutation(100, rng, 2));
  CHECK_THROWS_WITH(permutation(-1, rng, 0), "[permutation] n must not be negative, got -1");
}

TEST_CASE("random: the thread count changes nothing") {
  const CounterRng rng(13, 4);
  auto draw = [&](int n_threads) {
    const ScopedThreads scope(n_threads);
    std::vector<float> x(1000);
    parallel_for(1000, 10, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i)
        x[static_cast<std::size_t>(i)] = rng.normal2(1, static_cast<std::uint64_t>(i))[1];
    });
    return x;
  };
  CHECK(draw(1) == draw(2));
}
