#pragma once
#include <fieldmark/engine/gradcheck.h>
#include <fieldmark/engine/products.h>

#include <span>
#include <utility>

namespace fieldmark {

/// A function under test in both forms, made from one generic lambda [](auto& tape, auto x): of Vars for
/// gradients and of Duals for tangents.
struct SmoothFn {
  GradcheckFn vars;            ///< for reverse mode
  DualFunction<double> duals;  ///< for forward mode
  /// @param f  callable with Vars and with Duals
  template <class F>
  SmoothFn(F f) : vars(f), duals(std::move(f)) {}
};

/// Compares products with the Jacobian J and the Hessian with 6-point central differences, in double, for a
/// fixed random direction v of all inputs and a cotangent u:
///   J v by tangents with d/ds f(x + s v)
///   <u, J v> with <J^T u, v>, to 1e-12 of the sum of their terms
///   H v, H the Hessian of <u, f(x)>, with d/ds of the gradient J^T u at x + s v
/// Errors against differences are relative to the largest of the entry's own magnitude, a thousandth of the
/// largest of its tensor, and the rounding error of the difference. NaN fails.
/// Parameters that f reads through Params(store) receive gradients as in gradcheck().
/// @param options  step multiplies eps^(1/5), the step of s; v lies in [-1, 1]
/// @return entries counts those of J v and H v
/// @throws ValueError if there are no inputs or an option is out of range   @throws whatever f throws
GradcheckReport gradcheck_second_order(const SmoothFn& f, std::span<const Tensor<double>> inputs,
                                       const GradcheckOptions& options = {});

}  // namespace fieldmark
