#pragma once
#include <fieldmark/engine/params.h>

#include <span>
#include <string>
#include <vector>

namespace fieldmark {

/// What the elements of one tensor, or of its gradient, look like. NaN and infinities are counted and stay
/// out of the mean, the root mean square and the largest magnitude, which are 0 where no element is finite.
struct TensorStats {
  std::string name;     ///< of the value or parameter
  Index count = 0;      ///< elements, of all passes together
  Index zeros = 0;      ///< elements that are exactly 0
  Index nonfinite = 0;  ///< elements that are NaN or infinite
  double mean = 0;      ///< of the finite elements
  double rms = 0;       ///< root mean square of the finite elements; no square overflows
  double largest = 0;   ///< magnitude among the finite elements

  /// The part of the elements that is exactly 0, in [0, 1]; 0 of none.
  double zero_fraction() const {
    return count > 0 ? static_cast<double>(zeros) / static_cast<double>(count) : 0;
  }
  /// Adds the elements that `other` describes; the name stays.
  void merge(const TensorStats& other);
};

/// The statistics of some elements, summed in double.
template <class T>
TensorStats tensor_stats(std::string name, std::span<const T> elements);

/// The statistics of the gradient of each trained tensor of a store, in its order: for loops over shards,
/// which have no tape to inspect.
template <class T>
std::vector<TensorStats> gradient_stats(ParamStore<T>& store);

/// The statistics of each tensor of a store, in its order.
template <class T>
std::vector<TensorStats> value_stats(const ParamStore<T>& store);

/// Statistics as a table, one line for each.
std::string stats_table(std::span<const TensorStats> stats);

}  // namespace fieldmark
