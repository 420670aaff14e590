#pragma once
#include <fieldmark/watermark/mark/cell_grid.h>
#include <fieldmark/watermark/payload/message.h>

#include <array>
#include <cstdint>
#include <functional>
#include <span>

namespace fieldmark::watermark {

/// Counts of keys, independent of an image, that reach a p-value.
struct WrongKeyCounts {
  static constexpr int kThresholds = 8;  ///< the least p-value counted is 10^-kThresholds
  Index n = 0;                           ///< keys tried
  /// counts[i] keys reached p <= 10^-(i + 1).
  std::array<Index, kThresholds> counts{};
  double least_p = 1;                     ///< least p-value over all keys; 1 without keys
  static constexpr int kBins = 80;        ///< of the histogram
  static constexpr int kBinsPerUnit = 4;  ///< the histogram spans T from -10 to 10
  /// histogram[i] keys gave a statistic T with i <= 4 (T + 10) < i + 1; the end bins include outliers.
  std::array<Index, kBins> histogram{};
  /// Counts one more key.   @param statistic  T   @throws ValueError if it is NaN
  void add(double statistic);
  /// Adds the counts of another object.
  void add(const WrongKeyCounts& other);
  /// Equal in everything.
  friend bool operator==(const WrongKeyCounts&, const WrongKeyCounts&) = default;
};

/// Tests the same evidence under n wrong keys (see keyed_statistic, keyed_p_value). The keys are BLAKE2b of
/// the seed, independent of any random_key(). Counts do not depend on the number of threads. 10^4 keys on 500
/// cells take 0.4 s on one core.
/// @param evidence  [cells] summed sign evidence   @param weights  as for deal_cells
/// @param n         number of keys, >= 0
/// @param progress  called from time to time with (done, total); returns false to stop, which throws Error
/// @throws ValueError as deal_cells and keyed_statistic, or if n < 0
WrongKeyCounts count_wrong_keys(std::span<const double> evidence, const CellWeights& weights,
                                const Message& message, Index n, std::uint64_t seed,
                                const std::function<bool(Index, Index)>& progress = {});

/// Returns a quantile of the binomial distribution: the least k with P(X <= k) >= level, X ~ Binomial(n, p).
/// @param n  >= 0   @param p  in [0, 1]   @param level  in (0, 1)   @throws ValueError otherwise
Index binomial_upper(Index n, double p, double level = 0.99);

/// Interval of counts, both ends included.
struct CountInterval {
  Index low = 0;   ///< at least
  Index high = 0;  ///< at most
  /// Equal at both ends.
  friend bool operator==(const CountInterval&, const CountInterval&) = default;
};

/// Returns the narrowest interval with a probability of at most (1 - level) / 2 on either side,
/// X ~ Binomial(n, p).
/// @param n  >= 0   @param p  in [0, 1]   @param level  in (0, 1)   @throws ValueError otherwise
CountInterval binomial_interval(Index n, double p, double level = 0.99);

}  // namespace fieldmark::watermark
