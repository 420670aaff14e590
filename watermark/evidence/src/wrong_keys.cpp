#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/watermark/evidence/evidence.h>
#include <fieldmark/watermark/evidence/wrong_keys.h>
#include <fieldmark/watermark/keys/keyed_hash.h>
#include <fieldmark/watermark/mark/cell_code.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace fieldmark::watermark {
namespace {
constexpr Index kKeysPerChunk = 128, kChunksPerRound = 64;

constexpr std::array<double, WrongKeyCounts::kThresholds> kThresholdValues{1e-1, 1e-2, 1e-3, 1e-4,
                                                                           1e-5, 1e-6, 1e-7, 1e-8};

// P(X = k + 1) / P(X = k) of a binomial with odds p / (1 - p).
long double rise(Index k, Index n, long double odds) {
  return static_cast<long double>(n - k) / static_cast<long double>(k + 1) * odds;
}

void check_binomial(Index n, double p, double level) {
  if (n < 0) throw ValueError("[binomial_upper] n must be at least 0, got " + std::to_string(n));
  if (!(p >= 0 && p <= 1)) throw ValueError("[binomial_upper] p must be in [0, 1], got " + std::to_string(p));
  if (!(level > 0 && level < 1)) {
    throw ValueError("[binomial_upper] level must be in (0, 1), got " + std::to_string(level));
  }
}
}  // namespace

void WrongKeyCounts::add(double statistic) {
  const double p = keyed_p_value(statistic);
  for (std::size_t i = 0; i < counts.size(); ++i) counts[i] += p <= kThresholdValues[i];
  least_p = std::min(least_p, p);
  constexpr int kZero = kBins / 2;
  ++histogram[static_cast<std::size_t>(
      std::clamp(std::floor(statistic * kBinsPerUnit) + kZero, 0., kBins - 1.))];
  ++n;
}

void WrongKeyCounts::add(const WrongKeyCounts& other) {
  n += other.n;
  for (std::size_t i = 0; i < counts.size(); ++i) counts[i] += other.counts[i];
  for (std::size_t i = 0; i < histogram.size(); ++i) histogram[i] += other.histogram[i];
  least_p = std::min(least_p, other.least_p);
}

WrongKeyCounts count_wrong_keys(std::span<const double> evidence, const CellWeights& weights,
                                const Message& message, Index n, std::uint64_t seed,
                                const std::function<bool(Index, Index)>& progress) {
  if (n < 0) throw ValueError("[count_wrong_keys] n must be at least 0, got " + std::to_string(n));
  const CellDealer dealer(weights, message.size());
  const Key root = key_of_seed(seed);
  WrongKeyCounts total;
  while (total.n < n) {
    const Index first = total.n, round = std::min(n - first, kKeysPerChunk * kChunksPerRound);
    std::array<WrongKeyCounts, kChunksPerRound> chunks;
    parallel_for(round, kKeysPerChunk, [&](Index begin, Index end) {
      CellCode code;
      WrongKeyCounts& chunk = chunks[static_cast<std::size_t>(begin / kKeysPerChunk)];
      for (Index i = first + begin; i < first + end; ++i) {
        dealer.deal(derive_key(root, "fieldmark wrong key", static_cast<std::uint64_t>(i)), code);
        chunk.add(keyed_statistic(evidence, code, message));
      }
    });
    for (const WrongKeyCounts& chunk : chunks) total.add(chunk);
    if (progress && !progress(total.n, n)) throw Error("[count_wrong_keys] stopped");
  }
  return total;
}

Index binomial_upper(Index n, double p, double level) {
  check_binomial(n, p, level);
  if (p == 0 || n == 0) return 0;
  if (p == 1) return n;
  // Sums weights relative to that of the mode, down to negligible ones: no factorials, and no underflow for
  // any n.
  const long double odds = static_cast<long double>(p) / (1 - static_cast<long double>(p));
  const auto mode = std::min(n, static_cast<Index>(static_cast<double>(n + 1) * p));
  constexpr long double kNegligible = 1e-25L;
  std::vector<long double> below, above{1};
  for (Index k = mode; k > 0; --k) {
    below.push_back((below.empty() ? 1 : below.back()) / rise(k - 1, n, odds));
    if (below.back() < kNegligible) break;
  }
  for (Index k = mode; k < n && above.back() >= kNegligible; ++k)
    above.push_back(above.back() * rise(k, n, odds));
  long double total = 0;
  for (long double weight : below) total += weight;
  for (long double weight : above) total += weight;

  long double cumulated = 0;
  for (std::size_t i = below.size(); i-- > 0;) {
    cumulated += below[i];
    if (cumulated >= level * total) return mode - 1 - static_cast<Index>(i);
  }
  for (std::size_t i = 0; i < above.size(); ++i) {
    cumulated += above[i];
    if (cumulated >= level * total) return mode + static_cast<Index>(i);
  }
  return mode + static_cast<Index>(above.size()) - 1;
}

CountInterval binomial_interval(Index n, double p, double level) {
  // n - X ~ Binomial(n, 1 - p), and its upper bound gives the lower bound of X.
  const double each = 1 - (1 - level) / 2;
  return {n - binomial_upper(n, 1 - p, each), binomial_upper(n, p, each)};
}

}  // namespace fieldmark::watermark
