#pragma once
#include <fieldmark/engine/chain_steps.h>

namespace fieldmark {

class Chain;

/// A value within a chain of elementwise steps, see fused(). Valid as long as its chain.
class Lane {
 private:
  friend class Chain;
  Lane(Chain* chain, int index) : chain_(chain), index_(index) {}
  Chain* chain_;
  int index_;
};

/// A chain of elementwise steps, recorded once and run over blocks of elements. fused() records its function
/// as a Chain; bindings build one directly, because they know the function only at run time.
class Chain {
 public:
  static constexpr int kMaxInputs = detail::kChainInputs;  ///< maximum number of inputs
  static constexpr int kMaxSteps = detail::kChainSteps;    ///< maximum number of steps

  /// @param inputs  1 to kMaxInputs   @throws ValueError otherwise
  explicit Chain(int inputs);
  Chain(const Chain&) = delete;
  Chain& operator=(const Chain&) = delete;
  /// Returns input k. @throws ValueError if there is none
  Lane input(int k);
  /// Declares the result; steps recorded after it are dropped.
  /// @throws ValueError if it belongs to another chain
  void finish(Lane result);

  /// @{
  /// Appends a step with the parameters p and q. For use by the functions below.
  /// @throws ValueError if the chain already has kMaxSteps, or a Lane belongs to another chain
  static Lane record(detail::ChainOp op, Lane a, double p = 0, double q = 0);
  static Lane record(detail::ChainOp op, Lane a, Lane b);
  /// @}

  /// Returns the steps. @throws ValueError before finish()
  const detail::ChainSteps& steps() const;

 private:
  Lane append(detail::ChainOp op, Lane a, Lane b, double p, double q);
  detail::ChainSteps steps_;
  bool finished_ = false;
};

/// @{
/// Appends the step of the corresponding operator in operators.h.
Lane operator+(Lane a, Lane b);
Lane operator-(Lane a, Lane b);
Lane operator*(Lane a, Lane b);
Lane operator/(Lane a, Lane b);
Lane operator-(Lane a);
Lane operator+(Lane a, double number);
Lane operator+(double number, Lane a);
Lane operator-(Lane a, double number);
Lane operator-(double number, Lane a);
Lane operator*(Lane a, double number);
Lane operator*(double number, Lane a);
/// @throws ValueError if the number is 0
Lane operator/(Lane a, double number);
Lane operator/(double number, Lane a);
/// @}

/// @{
/// Appends the step of the op with the same name in arithmetic.h, math.h or activation.h.
Lane minimum(Lane a, Lane b);
Lane maximum(Lane a, Lane b);
Lane affine(Lane x, double factor, double offset);
Lane square(Lane x);
Lane sqrt(Lane x);
Lane abs(Lane x);
Lane reciprocal(Lane x);
Lane exp(Lane x);
Lane log(Lane x);
Lane tanh(Lane x);
Lane sigmoid(Lane x);
Lane softplus(Lane x);
Lane relu(Lane x);
/// @}

}  // namespace fieldmark
