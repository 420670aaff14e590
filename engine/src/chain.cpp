#include <fieldmark/core/error.h>
#include <fieldmark/engine/chain.h>

#include <string>

namespace fieldmark {

using detail::ChainOp;

Chain::Chain(int inputs) : steps_{.inputs = inputs, .count = 0, .step = {}} {
  if (inputs < 1 || inputs > kMaxInputs)
    throw ValueError("[fused] inputs must be 1 to " + std::to_string(kMaxInputs) + ", got " +
                     std::to_string(inputs));
}

Lane Chain::input(int k) {
  if (k < 0 || k >= steps_.inputs)
    throw ValueError("[fused] the chain has inputs 0 to " + std::to_string(steps_.inputs - 1) + ", got " +
                     std::to_string(k));
  return {this, k};
}

Lane Chain::append(ChainOp op, Lane a, Lane b, double p, double q) {
  if (a.chain_ != this || b.chain_ != this)
    throw ValueError("[fused] a value belongs to another chain: pass it as one more input");
  if (steps_.count == kMaxSteps)
    throw ValueError("[fused] a chain has at most " + std::to_string(kMaxSteps) +
                     " steps: split it into two");
  steps_.step[steps_.count] = {op, static_cast<std::uint8_t>(a.index_), static_cast<std::uint8_t>(b.index_),
                               p, q};
  return {this, steps_.inputs + steps_.count++};
}

Lane Chain::record(ChainOp op, Lane a, double p, double q) { return a.chain_->append(op, a, a, p, q); }
Lane Chain::record(ChainOp op, Lane a, Lane b) { return a.chain_->append(op, a, b, 0, 0); }

void Chain::finish(Lane result) {
  if (result.chain_ != this) throw ValueError("[fused] the result belongs to another chain");
  if (result.index_ < steps_.inputs) result = affine(result, 1, 0);
  steps_.count = result.index_ - steps_.inputs + 1;
  finished_ = true;
}

const detail::ChainSteps& Chain::steps() const {
  if (!finished_) throw ValueError("[fused] the chain has no result yet: call finish()");
  return steps_;
}

Lane operator+(Lane a, Lane b) { return Chain::record(ChainOp::add, a, b); }
Lane operator-(Lane a, Lane b) { return Chain::record(ChainOp::sub, a, b); }
Lane operator*(Lane a, Lane b) { return Chain::record(ChainOp::mul, a, b); }
Lane operator/(Lane a, Lane b) { return Chain::record(ChainOp::div, a, b); }
Lane operator-(Lane a) { return affine(a, -1, 0); }
Lane operator+(Lane a, double number) { return affine(a, 1, number); }
Lane operator+(double number, Lane a) { return affine(a, 1, number); }
Lane operator-(Lane a, double number) { return affine(a, 1, -number); }
Lane operator-(double number, Lane a) { return affine(a, -1, number); }
Lane operator*(Lane a, double number) { return affine(a, number, 0); }
Lane operator*(double number, Lane a) { return affine(a, number, 0); }
Lane operator/(Lane a, double number) {
  if (number == 0) throw ValueError("[div] divisor must not be 0");
  return Chain::record(ChainOp::divide, a, number);
}
Lane operator/(double number, Lane a) { return Chain::record(ChainOp::quotient, a, number); }

Lane minimum(Lane a, Lane b) { return Chain::record(ChainOp::minimum, a, b); }
Lane maximum(Lane a, Lane b) { return Chain::record(ChainOp::maximum, a, b); }
Lane affine(Lane x, double factor, double offset) {
  return Chain::record(ChainOp::affine, x, factor, offset);
}
Lane square(Lane x) { return Chain::record(ChainOp::square, x); }
Lane sqrt(Lane x) { return Chain::record(ChainOp::sqrt, x); }
Lane abs(Lane x) { return Chain::record(ChainOp::abs, x); }
Lane reciprocal(Lane x) { return 1.0 / x; }
Lane exp(Lane x) { return Chain::record(ChainOp::exp, x); }
Lane log(Lane x) { return Chain::record(ChainOp::log, x); }
Lane tanh(Lane x) { return Chain::record(ChainOp::tanh, x); }
Lane sigmoid(Lane x) { return Chain::record(ChainOp::sigmoid, x); }
Lane softplus(Lane x) { return Chain::record(ChainOp::softplus, x); }
Lane relu(Lane x) { return Chain::record(ChainOp::relu, x); }

}  // namespace fieldmark
