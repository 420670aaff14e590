#pragma once
#include <cstdint>

// The steps of a chain as kernels read them. Plain data only: two instruction sets must never share an inline
// function.
namespace fieldmark::detail {

inline constexpr int kChainInputs = 8, kChainSteps = 32;

/// What a step computes of its operands a and b and its numbers p and q.
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

/// One step. Operands are numbered: inputs first, then the results of the steps; b is a where there is one.
struct ChainStep {
  ChainOp op;      ///< what it computes
  std::uint8_t a;  ///< number of its first operand
  std::uint8_t b;  ///< number of its second operand
  double p;        ///< first number
  double q;        ///< second number
};

/// A chain whose result is that of its last step.
struct ChainSteps {
  int inputs;                   ///< how many inputs
  int count;                    ///< how many steps
  ChainStep step[kChainSteps];  ///< in the order of computation
};

}  // namespace fieldmark::detail
