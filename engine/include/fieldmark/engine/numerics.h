#pragma once
#include <fieldmark/core/worst.h>
#include <fieldmark/engine/tape.h>
#include <fieldmark/engine/tensor.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

namespace fieldmark {

/// The largest error of several values, each relative to its own scale.
struct WorstError {
  double worst = 0;  ///< NaN if any error is NaN
  Index values = 0;  ///< number of values compared

  /// Adds the error |value - exact| / scale; 0 for equal values, even infinite ones. @param scale  > 0
  void compare(long double value, long double exact, long double scale) {
    ++values;
    raise_to(worst, value == exact ? 0.0 : static_cast<double>(std::abs(value - exact) / scale));
  }
  /// Adds an error of 0 if both values are equal or both NaN, else infinity.
  void equal(long double value, long double exact) {
    const bool same = value == exact || (std::isnan(value) && std::isnan(exact));
    compare(same ? 0 : std::numeric_limits<long double>::infinity(), 0, 1);
  }
};

/// A case that stresses rounding or range, for `fieldmark gradcheck --numerics` and the tests. Compares the
/// library's values, on the instruction set in use, with the same formula in long double.
struct NumericsCase {
  std::string name;                 ///< begins with the unit's stem
  std::string type;                 ///< "float" or "double"
  std::string relative_to;          ///< scale of the errors
  double limit;                     ///< largest error allowed; 0: equal bits
  std::function<WorstError()> run;  ///< computes both and compares

  /// True if run() compared values and no error is above the limit or NaN.
  bool ok(const WorstError& error) const { return error.values > 0 && error.worst <= limit; }
};

/// Adds a case in float and in double. @param f  called as f(T{}, WorstError&), T the scalar type
template <class F>
void add_numerics(std::vector<NumericsCase>& cases, const std::string& name, const std::string& relative_to,
                  double float_limit, double double_limit, F f) {
  const auto run = [f](auto zero) {
    return [f, zero] {
      WorstError error;
      f(zero, error);
      return error;
    };
  };
  cases.push_back({name, "float", relative_to, float_limit, run(0.f)});
  cases.push_back({name, "double", relative_to, double_limit, run(0.)});
}

/// Returns pseudorandom values in [lo, hi) from a seed (SplitMix64).
template <class T>
Tensor<T> scattered(Shape shape, double lo, double hi, std::uint64_t seed) {
  Tensor<T> t(shape);
  for (T& v : t.data) {
    std::uint64_t z = seed += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    v = static_cast<T>(lo + (hi - lo) * static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1.0p-53);
  }
  return t;
}

/// Runs one pass of an op. Returns its values, then the gradient of <cotangent, op> in each input. The inputs
/// are outputs of a preceding op, as in a network, and memory holds NaN until it is filled.
/// @param f  called as f(tape, std::vector<Var<T>>)   @param cotangent  Shape -> Tensor<T>
template <class T, class F, class C>
std::vector<std::vector<T>> values_and_gradients(const F& f, const std::vector<Tensor<T>>& inputs,
                                                 const C& cotangent) {
  Tape<T> tape;
  tape.arena().spoil();
  std::vector<Tensor<T>> grads;
  grads.reserve(inputs.size());
  for (const auto& x : inputs) grads.emplace_back(x.shape);
  std::vector<Var<T>> vars;
  for (std::size_t k = 0; k < inputs.size(); ++k)
    vars.push_back(tape.reshape(tape.leaf(inputs[k], grads[k]), inputs[k].shape));
  const Var<T> y = f(tape, vars);
  tape.backward(y, cotangent(y.shape()).data);
  std::vector<std::vector<T>> result{{y.value(), y.value() + y.shape().size()}};
  for (auto& g : grads) result.push_back(std::move(g.data));
  return result;
}

/// Returns a cotangent of ones.
template <class T>
Tensor<T> ones(Shape shape) {
  return Tensor<T>(shape, T(1));
}

}  // namespace fieldmark
