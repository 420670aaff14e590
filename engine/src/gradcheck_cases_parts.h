#pragma once
#include <fieldmark/engine/gradcheck_cases.h>
#include <fieldmark/engine/gradcheck_second_order.h>

#include <cmath>
#include <type_traits>
#include <utility>

// Helpers shared by the parts of gradcheck_cases().
namespace fieldmark {

std::vector<GradcheckCase> fused_gradcheck_cases();
std::vector<GradcheckCase> tensor_gradcheck_cases();

namespace gradcheck_parts {

using D = Tape<double>;
using Vars = std::span<const Var<double>>;
using Cases = std::vector<GradcheckCase>;

// Pseudorandom values in [-1.6, 1.6], none within 0.1 of 0, the kink of ReLU.
inline Tensor<double> off_zero(Shape shape, double phase = 0) {
  Tensor<double> t(shape);
  for (Index i = 0; i < t.size(); ++i) {
    const double s = std::sin(1 + phase + 2.7 * static_cast<double>(i));
    t[i] = s < 0 ? 1.5 * s - 0.1 : 1.5 * s + 0.1;
  }
  return t;
}

// Values at least 0.1 apart: differences must not change the largest of a window.
inline Tensor<double> apart(Shape shape) {
  Tensor<double> t(shape);
  for (Index i = 0; i < t.size(); ++i) t[i] = 0.1 * static_cast<double>(i * 37 % 101);
  return t;
}

// Checks an op. A generic lambda, which runs on Duals too, is also checked to second order.
template <class F>
Cases make(const std::string& name, F f, std::vector<Tensor<double>> inputs) {
  Cases cases{{name, [=] { return gradcheck(f, inputs); }}};
  if constexpr (std::is_convertible_v<F, DualFunction<double>>)
    cases.push_back({name + ", second order", [=] { return gradcheck_second_order(f, inputs); }});
  return cases;
}

inline Cases join(std::initializer_list<Cases> parts) {
  Cases all;
  for (const Cases& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

// Pseudorandom values in (-1, 1).
inline Tensor<double> mixed(Shape shape, double phase) {
  Tensor<double> t(shape);
  for (Index i = 0; i < t.size(); ++i) t[i] = std::sin(phase + 1.7 * static_cast<double>(i * i + i));
  return t;
}

}  // namespace gradcheck_parts
}  // namespace fieldmark
