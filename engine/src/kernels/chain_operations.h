#pragma once
// The operations of chain steps, forward and backward. Internal linkage, like simd.h.
#include "kernels/chain.h"
#include "kernels/functions.h"

namespace fieldmark::kernels {
namespace {

using detail::ChainOp;

// Applies f to whole vectors of float, or one by one to doubles, whose functions come from the C library.
template <class Vector, class F>
inline Vector each(Vector x, F f) {
  constexpr int lanes = static_cast<int>(sizeof(Vector) / sizeof(x[0]));
  Vector y = x;
  for (int k = 0; k < lanes; ++k) y[k] = f(x[k]);
  return y;
}
template <class Function>
inline simd::Vec<float> apply(simd::Vec<float> x) {
  return Function::value(x);
}
template <class Function>
inline simd::Vec<double> apply(simd::Vec<double> x) {
  return each(x, [](double v) { return Function::value(v); });
}
inline simd::Vec<float> root(simd::Vec<float> x) {
  return each(x, [](float v) { return __builtin_sqrtf(v); });
}
inline simd::Vec<double> root(simd::Vec<double> x) {
  return each(x, [](double v) { return __builtin_sqrt(v); });
}

// A step's value, and dL/da and dL/db from g = dL/dy. Ties of minimum and maximum go to a.
template <class Vector>
struct Operands {
  Vector a, b, y, g, p, q;
};
struct Add {
  static auto value(auto o) { return o.a + o.b; }
  static auto to_a(auto o) { return o.g; }
  static auto to_b(auto o) { return o.g; }
};
struct Sub {
  static auto value(auto o) { return o.a - o.b; }
  static auto to_a(auto o) { return o.g; }
  static auto to_b(auto o) { return -o.g; }
};
struct Mul {
  static auto value(auto o) { return o.a * o.b; }
  static auto to_a(auto o) { return o.g * o.b; }
  static auto to_b(auto o) { return o.g * o.a; }
};
struct Div {
  static auto value(auto o) { return o.a / o.b; }
  static auto to_a(auto o) { return o.g / o.b; }
  static auto to_b(auto o) { return -o.g * o.y / o.b; }
};
// A comparison with NaN is false; the sum then makes the result NaN.
struct Minimum {
  static auto value(auto o) { return o.a <= o.b ? o.a : (o.b < o.a ? o.b : o.a + o.b); }
  static auto to_a(auto o) { return o.b < o.a ? decltype(o.g){} : o.g; }
  static auto to_b(auto o) { return o.b < o.a ? o.g : decltype(o.g){}; }
};
struct Maximum {
  static auto value(auto o) { return o.a >= o.b ? o.a : (o.b > o.a ? o.b : o.a + o.b); }
  static auto to_a(auto o) { return o.b > o.a ? decltype(o.g){} : o.g; }
  static auto to_b(auto o) { return o.b > o.a ? o.g : decltype(o.g){}; }
};
struct Affine {
  static auto value(auto o) { return o.p * o.a + o.q; }
  static auto to_a(auto o) { return o.p * o.g; }
};
struct Divide {
  static auto value(auto o) { return o.a / o.p; }
  static auto to_a(auto o) { return o.g / o.p; }
};
struct Quotient {
  static auto value(auto o) { return o.p / o.a; }
  static auto to_a(auto o) { return -o.g * o.y / o.a; }
};
struct Square {
  static auto value(auto o) { return o.a * o.a; }
  static auto to_a(auto o) { return 2 * o.g * o.a; }
};
struct Sqrt {
  static auto value(auto o) { return root(o.a); }
  static auto to_a(auto o) { return o.g / (2 * o.y); }
};
struct Abs {
  static auto value(auto o) { return o.a < 0 ? -o.a : o.a; }
  static auto to_a(auto o) { return o.a < 0 ? -o.g : (o.a > 0 ? o.g : decltype(o.g){}); }
};
struct LogStep {
  static auto value(auto o) { return apply<Log>(o.a); }
  static auto to_a(auto o) { return o.g / o.a; }
};
template <class Function>
struct Of {
  static auto value(auto o) { return apply<Function>(o.a); }
  static auto to_a(auto o) { return o.g * Function::slope(o.a, o.y); }
};
struct SoftplusStep {
  static auto value(auto o) { return apply<Softplus>(o.a); }
  static auto to_a(auto o) { return o.g * apply<Sigmoid>(o.a); }
};

// Calls run(Op{}) with the operation that a step names.
template <class Run>
[[gnu::always_inline]] inline void dispatch(ChainOp op, Run run) {
  switch (op) {
    case ChainOp::add:
      return run(Add{});
    case ChainOp::sub:
      return run(Sub{});
    case ChainOp::mul:
      return run(Mul{});
    case ChainOp::div:
      return run(Div{});
    case ChainOp::minimum:
      return run(Minimum{});
    case ChainOp::maximum:
      return run(Maximum{});
    case ChainOp::affine:
      return run(Affine{});
    case ChainOp::divide:
      return run(Divide{});
    case ChainOp::quotient:
      return run(Quotient{});
    case ChainOp::square:
      return run(Square{});
    case ChainOp::sqrt:
      return run(Sqrt{});
    case ChainOp::abs:
      return run(Abs{});
    case ChainOp::exp:
      return run(Of<Exp>{});
    case ChainOp::log:
      return run(LogStep{});
    case ChainOp::tanh:
      return run(Of<Tanh>{});
    case ChainOp::sigmoid:
      return run(Of<Sigmoid>{});
    case ChainOp::softplus:
      return run(SoftplusStep{});
    case ChainOp::relu:
      return run(Of<Relu>{});
  }
}

inline bool is_binary(ChainOp op) { return op <= ChainOp::maximum; }

// The values that the slopes of an operation read.
struct Reads {
  bool a = false, b = false, y = false;
};
Reads slope_reads(ChainOp op) {
  switch (op) {
    case ChainOp::add:
    case ChainOp::sub:
    case ChainOp::affine:
    case ChainOp::divide:
      return {};
    case ChainOp::mul:
    case ChainOp::minimum:
    case ChainOp::maximum:
      return {.a = true, .b = true};
    case ChainOp::div:
      return {.b = true, .y = true};
    case ChainOp::quotient:
      return {.a = true, .y = true};
    case ChainOp::square:
    case ChainOp::abs:
    case ChainOp::log:
    case ChainOp::softplus:
    case ChainOp::relu:
      return {.a = true};
    case ChainOp::sqrt:
    case ChainOp::exp:
    case ChainOp::tanh:
    case ChainOp::sigmoid:
      return {.y = true};
  }
  return {.a = true, .b = true, .y = true};
}

}  // namespace
}  // namespace fieldmark::kernels
