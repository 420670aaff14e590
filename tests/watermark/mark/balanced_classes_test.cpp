#include "balanced_classes.h"

#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/random.h>

#include <algorithm>
#include <numeric>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

constexpr std::size_t kCells = 300, kViews = 9;
constexpr Index kBits = 8;

// Each view shows a third of the cells.
std::vector<std::int32_t> some_strength(std::uint64_t seed) {
  const CounterRng rng(seed, 1);
  std::vector<std::int32_t> strength;
  for (std::uint64_t v = 0; v < kViews; ++v)
    for (std::uint64_t c = 0; c < kCells; ++c) {
      const auto u = rng.uniform4(v, c);
      strength.push_back(u[0] < 0.33f ? static_cast<std::int32_t>(30000 * u[1]) : 0);
    }
  return strength;
}

std::vector<std::size_t> in_order() {
  std::vector<std::size_t> ranked(kCells);
  std::iota(ranked.begin(), ranked.end(), std::size_t{0});
  return ranked;
}

// Returns the least share of a mean class's strength that a view shows of a class.
double least_share(const std::vector<std::int32_t>& strength, const std::vector<std::int32_t>& classes) {
  double least = 1;
  for (std::size_t v = 0; v < kViews; ++v) {
    std::vector<double> shown(kBits);
    for (std::size_t c = 0; c < kCells; ++c)
      shown[static_cast<std::size_t>(classes[c])] += strength[v * kCells + c];
    const double mean = std::accumulate(shown.begin(), shown.end(), 0.0) / kBits;
    least = std::min(least, *std::min_element(shown.begin(), shown.end()) / mean);
  }
  return least;
}

}  // namespace

TEST_CASE("balanced_classes: every class gets one cell of each group, the last group is short") {
  const auto strength = some_strength(1);
  const std::vector<double> area(kCells, 1);
  const auto classes = balanced_classes({std::span<const double>(area), strength}, in_order(), kBits);
  REQUIRE(classes.size() == kCells);
  for (std::size_t begin = 0; begin < kCells; begin += kBits) {
    std::vector<std::int32_t> group(
        classes.begin() + static_cast<std::ptrdiff_t>(begin),
        classes.begin() + static_cast<std::ptrdiff_t>(std::min(begin + kBits, kCells)));
    std::ranges::sort(group);
    CHECK(std::ranges::adjacent_find(group) == group.end());
    CHECK(group.front() >= 0);
    CHECK(group.back() < kBits);
  }
}

TEST_CASE("balanced_classes: the steps of the definition, in double") {
  const auto strength = some_strength(2);
  const std::vector<double> area(kCells, 1);
  const auto classes = balanced_classes({std::span<const double>(area), strength}, in_order(), kBits);
  const double mean = std::accumulate(strength.begin(), strength.end(), 0.0) / (kViews * kBits);
  std::vector<std::vector<double>> shown(kBits, std::vector<double>(kViews));
  std::vector<bool> taken(kBits);
  for (std::size_t c = 0; c < kCells; ++c) {
    if (c % kBits == 0) std::fill(taken.begin(), taken.end(), false);
    double most = -1, chosen = -1;
    for (std::size_t k = 0; k < kBits; ++k) {
      if (taken[k]) continue;
      double gain = 0;
      for (std::size_t v = 0; v < kViews; ++v) gain += strength[v * kCells + c] / (shown[k][v] + mean / 4);
      most = std::max(most, gain);
      if (static_cast<std::int32_t>(k) == classes[c]) chosen = gain;
    }
    CHECK(chosen >= most * (1 - 1e-4));  // whole numbers round
    taken[static_cast<std::size_t>(classes[c])] = true;
    for (std::size_t v = 0; v < kViews; ++v)
      shown[static_cast<std::size_t>(classes[c])][v] += strength[v * kCells + c];
  }
}

TEST_CASE("balanced_classes: views show more of the least class than of the least of classes dealt in turn") {
  const std::vector<double> area(kCells, 1);
  std::vector<std::int32_t> in_turn(kCells);
  for (std::size_t c = 0; c < kCells; ++c) in_turn[c] = static_cast<std::int32_t>(c % kBits);
  for (std::uint64_t seed = 3; seed < 8; ++seed) {
    const auto strength = some_strength(seed);
    const auto classes = balanced_classes({std::span<const double>(area), strength}, in_order(), kBits);
    CHECK(least_share(strength, classes) > least_share(strength, in_turn) + 0.1);
  }
}

TEST_CASE(
    "balanced_classes: the same for any number of threads, and cells that nothing shows get classes, too") {
  const auto strength = some_strength(9);
  const std::vector<double> area(kCells, 1);
  const CellWeights weights{std::span<const double>(area), strength};
  std::vector<std::vector<std::int32_t>> all;
  for (const int threads : {1, 2, 3}) {
    const ScopedThreads scope(threads);
    all.push_back(balanced_classes(weights, in_order(), 40));
  }
  CHECK(all[0] == all[1]);
  CHECK(all[0] == all[2]);
  const std::vector<std::int32_t> nothing(kCells, 0);
  const auto classes = balanced_classes({std::span<const double>(area), nothing}, in_order(), kBits);
  for (std::size_t c = 0; c < kCells; ++c)
    CHECK(classes[c] == static_cast<std::int32_t>(c) % std::int32_t{kBits});
}
