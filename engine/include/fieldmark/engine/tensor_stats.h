#pragma once
#include <fieldmark/engine/params.h>

#include <span>
#include <string>
#include <vector>

namespace fieldmark {

/// Statistics of the elements of one tensor or its gradient. NaN and infinities are counted but excluded from
/// the mean, the root mean square and the largest magnitude, which are 0 if no element is finite.
struct TensorStats {
  std::string name;     ///< of the value or parameter
  Index count = 0;      ///< elements over all passes
  Index zeros = 0;      ///< elements that are exactly 0
  Index nonfinite = 0;  ///< elements that are NaN or infinite
  double mean = 0;      ///< of the finite elements
  double rms = 0;       ///< root mean square of the finite elements; no square overflows
  double largest = 0;   ///< largest magnitude of the finite elements

  /// Returns the fraction of elements that are exactly 0, in [0, 1]; 0 if there are no elements.
  double zero_fraction() const {
    return count > 0 ? static_cast<double>(zeros) / static_cast<double>(count) : 0;
  }
  /// Adds the elements that `other` describes. Keeps the name.
  void merge(const TensorStats& other);
};

/// Computes the statistics of elements, summed in double.
template <class T>
TensorStats tensor_stats(std::string name, std::span<const T> elements);

/// Computes the statistics of the gradient of each trained tensor of a store, in store order; for loops over
/// shards, which have no tape to inspect.
template <class T>
std::vector<TensorStats> gradient_stats(ParamStore<T>& store);

/// Computes the statistics of each tensor of a store, in store order.
template <class T>
std::vector<TensorStats> value_stats(const ParamStore<T>& store);

/// Formats statistics as a table, one line each.
std::string stats_table(std::span<const TensorStats> stats);

}  // namespace fieldmark
