#pragma once
#include <cstdint>

// The steps of a chain in the form that kernels read. Plain data only: two instruction sets must never share
// an inline function.
namespace fieldmark::detail {

inline constexpr int kChainInputs = 8, kChainSteps = 32;

/// What a step computes from its operands a and b and its parameters p and q.
enum class ChainOp : std::uint8_t {
  add,
  sub,
  mul,
  div,
  minimum,
  maximum,
  affine,    ///< p a + q
  divide,    ///< a / p
  quotient,  ///< p / a
  square,
  sqrt,
  abs,
  exp,
  log,
  tanh,
  sigmoid,
  softplus,
  relu
};

/// One step. Operands are numbered: inputs first, then the results of the steps. With one operand, b is a.
struct ChainStep {
  ChainOp op;      ///< what it computes
  std::uint8_t a;  ///< number of its first operand
  std::uint8_t b;  ///< number of its second operand
  double p;        ///< first parameter
  double q;        ///< second parameter
};

/// A chain. The result of its last step is the result of the chain.
struct ChainSteps {
  int inputs;                   ///< number of inputs
  int count;                    ///< number of steps
  ChainStep step[kChainSteps];  ///< in the order of computation
};

}  // namespace fieldmark::detail
