#pragma once
#include <fieldmark/engine/aligned.h>
#include <fieldmark/engine/params.h>

#include <span>

namespace fieldmark {

/// Settings of Sgd.
struct SgdOptions {
  double lr = 1e-2;         ///< > 0; step size before a schedule's factor
  double momentum = 0;      ///< in [0, 1), decay of the velocity
  bool nesterov = false;    ///< steps along the gradient plus momentum times the new velocity
  double weight_decay = 0;  ///< >= 0, added to the gradient as weight_decay x
};

/// Stochastic gradient descent with momentum on a flat array of parameters.
///   g' = g + weight_decay x,   u = momentum u + g',   x -= lr u      (Nesterov: x -= lr (g' + momentum u))
/// Source: Sutskever et al. 2013, eq. 1 to 4, in PyTorch's form, where the velocity excludes the step size.
template <class T>
class Sgd {
 public:
  /// Optimises n parameters, all of them trained. @throws ValueError if n is negative or an option is out of
  /// range
  explicit Sgd(Index n, SgdOptions options = {});
  /// Optimises the parameters of a store. Steps never change its running ones. No parameters may be added to
  /// the store afterwards. @throws ValueError if an option is out of range
  explicit Sgd(const ParamStore<T>& store, SgdOptions options = {});

  /// Takes one step over all parameters.
  /// @param values, grads  [n]   @param lr_factor  multiplies the options' lr
  /// @throws ShapeError unless both have n elements
  void step(std::span<T> values, std::span<const T> grads, double lr_factor = 1);

  /// @{
  /// Returns u [n], for checkpoints.
  std::span<T> velocity() { return velocity_; }
  std::span<const T> velocity() const { return velocity_; }
  /// @}
  /// Returns the options given to the constructor.
  const SgdOptions& options() const { return options_; }

 private:
  SgdOptions options_;
  std::vector<std::pair<Index, Index>> trained_;  // [begin, end) of values that steps change
  AlignedVector<T> velocity_;
};

}  // namespace fieldmark
