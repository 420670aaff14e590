#pragma once
#include <fieldmark/engine/aligned.h>
#include <fieldmark/engine/params.h>
#include <fieldmark/engine/shape.h>

#include <span>
#include <string>
#include <utility>
#include <vector>

namespace fieldmark {

/// Settings of Adam. The defaults are those of the paper and of PyTorch.
struct AdamOptions {
  double lr = 1e-3;         ///< > 0; step size before a schedule's factor
  double beta1 = 0.9;       ///< in [0, 1), decay of the gradient's mean
  double beta2 = 0.999;     ///< in [0, 1), decay of the squared gradient's mean
  double eps = 1e-8;        ///< > 0, added to the root; use 1e-15 for tables, whose gradients are tiny
  bool skip_zero = false;   ///< skips entries with a gradient of exactly 0, and their moments; for tables
  double weight_decay = 0;  ///< >= 0, decoupled: x -= lr weight_decay x
  bool zero_grads = false;  ///< also sets the gradients to 0, in the same pass over memory
};

/// A range of parameters with its own step size and rules.
struct AdamRange {
  Index begin = 0;          ///< its first element
  Index end = 0;            ///< one past its last
  double lr_factor = 1;     ///< multiplies AdamOptions::lr
  bool skip_zero = false;   ///< replaces AdamOptions::skip_zero
  double weight_decay = 0;  ///< replaces AdamOptions::weight_decay
};

/// Adam on a flat array of parameters.
///   m = b1 m + (1 - b1) g,   v = b2 v + (1 - b2) g^2,
///   x -= lr (m / (1 - b1^t) / (sqrt(v / (1 - b2^t)) + eps) + weight_decay x)
/// Source: Kingma and Ba 2015, algorithm 1; the decay: Loshchilov and Hutter 2019, algorithm 2. Deviation:
/// entries that skip_zero skips share t with the others, so that a rarely touched entry has no bias
/// correction left (as in Mueller et al. 2022, section 4). A non-finite gradient spoils only its own entry.
template <class T>
class Adam {
 public:
  /// Optimises n parameters, all of them trained.
  /// @throws ValueError if n is negative or an option is out of range
  explicit Adam(Index n, AdamOptions options = {});
  /// Optimises the parameters of a store. Steps never change its running ones, whatever the decay. No
  /// parameters may be added to the store afterwards.
  /// @throws ValueError if an option is out of range
  explicit Adam(const ParamStore<T>& store, AdamOptions options = {});

  /// Takes one step over all parameters, with skip_zero and weight_decay of the options.
  /// @param values, grads  [n]   @param lr_factor  multiplies the options' lr
  /// @throws ShapeError unless both have n elements
  void step(std::span<T> values, std::span<T> grads, double lr_factor = 1);
  /// Takes one step over the given ranges, which must not overlap. Entries outside and their gradients are
  /// unchanged.
  /// @throws ShapeError unless both have n elements   @throws ValueError if a range is not within [0, n]
  void step(std::span<T> values, std::span<T> grads, std::span<const AdamRange> ranges);

  /// Extends the last step to one more range, for gradients that become complete range by range. The ranges
  /// of one step must not overlap; calls for different ranges may run concurrently.
  /// @throws as step(), and ValueError before the first step
  void extend_step(std::span<T> values, std::span<T> grads, const AdamRange& range);

  /// Returns the number of steps taken. A checkpoint holds it along with the two moments.
  Index steps() const { return steps_; }
  /// Sets the number of steps taken. @throws ValueError if negative
  void set_steps(Index steps);
  /// @{
  /// Returns m [n], for checkpoints.
  std::span<T> mean() { return mean_; }
  std::span<const T> mean() const { return mean_; }
  /// @}
  /// @{
  /// Returns v [n], for checkpoints.
  std::span<T> mean_square() { return mean_square_; }
  std::span<const T> mean_square() const { return mean_square_; }
  /// @}
  /// Returns the options given to the constructor.
  const AdamOptions& options() const { return options_; }

 private:
  void check(std::span<T> values, std::span<T> grads, std::span<const AdamRange> ranges) const;
  void update(std::span<T> values, std::span<T> grads, const AdamRange& range);
  void update_trained(std::span<T> values, std::span<T> grads, const AdamRange& range);
  AdamOptions options_;
  std::vector<std::pair<Index, Index>> running_;  // [begin, end) of values that no step changes, ascending
  AlignedVector<T> mean_, mean_square_;
  Index steps_ = 0;
};

/// A group of parameters that share a step size and rules.
struct AdamGroup {
  std::string names;        ///< pattern of names, see name_matches()
  AdamRange settings = {};  ///< all but begin and end
};

/// Returns the trained parameters of a store as ranges for Adam::step(), each with the settings of the first
/// group that matches its name. A parameter of no group is in no range, so that no step changes it.
///   const auto ranges = adam_ranges(store, {{"*bias"}, {"*", {.weight_decay = 0.01}}});
///   adam.step(store.values(), store.grads(), ranges);
/// @throws ValueError if a group matches no trained parameter
template <class T>
std::vector<AdamRange> adam_ranges(const ParamStore<T>& store, const std::vector<AdamGroup>& groups);

}  // namespace fieldmark
