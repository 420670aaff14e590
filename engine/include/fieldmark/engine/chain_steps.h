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
  ChainOp op;
  std::uint8_t a, b;
  double p, q;
};

/// A chain whose result is that of its last step.
struct ChainSteps {
  int inputs;
  int count;
  ChainStep step[kChainSteps];
};

}  // namespace fieldmark::detail
