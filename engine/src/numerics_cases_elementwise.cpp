#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/softmax.h>

#include <algorithm>

#include "numerics_cases_parts.h"

namespace fieldmark {
namespace {

using Real = long double;

// Samples [lo, hi] densely, and more densely near 0.
template <class T>
Tensor<T> points(double lo, double hi) {
  Tensor<T> x(Shape{20001});
  for (Index i = 0; i < x.size(); ++i) {
    const double u = lo + (hi - lo) * static_cast<double>(i) / 20000;
    x[i] = static_cast<T>(i % 4 == 0 ? u * 1e-4 : u);
  }
  return x;
}

Real exp_of(Real x) { return std::exp(x); }
Real density(Real x) { return std::exp(std::min<Real>(x, 15)); }
Real logistic(Real x) { return 1 / (1 + std::exp(-x)); }
Real logistic_slope(Real x) { return logistic(x) * logistic(-x); }
Real tanh_of(Real x) { return std::tanh(x); }
Real tanh_slope(Real x) { return 1 / (std::cosh(x) * std::cosh(x)); }
Real softplus_of(Real x) { return x > 60 ? x : std::log1p(std::exp(x)); }

// Compares an activation y = f(x) with its definition and slope on [lo, hi], where float has normal results.
// Errors are relative to the magnitude; those of the slope to slope_scale if that is larger.
struct Sweep {
  double lo, hi;
  Real (*value)(Real), (*slope)(Real);
  Real slope_scale;
};

template <class F>
void add_sweep(std::vector<NumericsCase>& cases, const std::string& name, const std::string& relative_to,
               double float_limit, double double_limit, const Sweep& sweep, F op) {
  add_numerics(cases, name, relative_to, float_limit, double_limit, [=](auto t, WorstError& error) {
    using T = decltype(t);
    const auto x = points<T>(sweep.lo, sweep.hi);
    const auto got = values_and_gradients<T>([&](auto&, const auto& v) { return op(v[0]); }, {x}, ones<T>);
    for (std::size_t i = 0; i < x.data.size(); ++i) {
      const Real at = x.data[i], y = sweep.value(at), slope = sweep.slope(at);
      error.compare(got[0][i], y, size_of<T>(y));
      error.compare(got[1][i], slope, std::max(size_of<T>(slope), sweep.slope_scale));
    }
  });
}

void add_sweeps(std::vector<NumericsCase>& cases) {
  add_sweep(cases, "activation: exp from -87.3 to 88", "value, slope", 3e-7, 3e-16,
            {-87.3, 88, exp_of, exp_of, 0}, [](auto v) { return exp(v); });
  add_sweep(cases, "activation: truncated_exp from -87.3 to 100", "value, slope", 3e-7, 3e-16,
            {-87.3, 100, density, density, 0}, [](auto v) { return truncated_exp(v); });
  add_sweep(cases, "activation: sigmoid from -87.3 to 100", "value, largest slope", 4e-7, 1e-15,
            {-87.3, 100, logistic, logistic_slope, 0.25L}, [](auto v) { return sigmoid(v); });
  add_sweep(cases, "activation: tanh from -30 to 30", "value, largest slope", 4e-7, 4e-16,
            {-30, 30, tanh_of, tanh_slope, 1}, [](auto v) { return tanh(v); });
  add_sweep(cases, "activation: softplus from -87.3 to 100", "value, slope", 4e-7, 4e-16,
            {-87.3, 100, softplus_of, logistic, 0}, [](auto v) { return softplus(v); });
}

// At the limits of T, each function has the value that its header states.
template <class T>
void compare_limits(WorstError& error) {
  using Limits = std::numeric_limits<T>;
  constexpr T top = Limits::max(), inf = Limits::infinity(), nan = Limits::quiet_NaN(),
              tiny = Limits::denorm_min();
  const Tensor<T> x(Shape{7}, {-inf, -top, -tiny, tiny, top, inf, nan});
  const T e15 = static_cast<T>(std::exp(Real{15})), one = 1, half = 0.5;
  const T most = sizeof(T) == 4 ? static_cast<T>(std::exp(Real{88})) : inf;
  const auto check = [&](auto op, const std::vector<T>& want) {
    const auto got = values_and_gradients<T>([&](auto&, const auto& v) { return op(v[0]); }, {x}, ones<T>);
    for (std::size_t i = 0; i < want.size(); ++i) {
      error.compare(got[0][i], want[i], size_of<T>(want[i]));
      if (std::isfinite(static_cast<double>(want[i]))) error.equal(std::isfinite(got[1][i]), true);
    }
    error.equal(got[0][6], nan);
  };
  check([](auto v) { return exp(v); }, {0, 0, one, one, most, most});
  check([](auto v) { return truncated_exp(v); }, {0, 0, one, one, e15, e15});
  check([](auto v) { return sigmoid(v); }, {0, 0, half, half, one, one});
  check([](auto v) { return tanh(v); }, {-one, -one, -tiny, tiny, one, one});
  const T log2 = static_cast<T>(std::log(Real{2}));
  check([](auto v) { return softplus(v); }, {0, 0, log2, log2, top, inf});
  check([](auto v) { return relu(v); }, {0, 0, 0, tiny, top, inf});
}

// One logit at a time: a mean would hide small losses behind large ones.
template <class T>
void compare_bce(T target, bool relative, WorstError& error) {
  for (const double x :
       {-1e4, -100.0, -88.0, -50.0, -17.0, -1.0, -1e-3, 0.0, 1e-3, 1.0, 17.0, 50.0, 88.0, 100.0, 1e4}) {
    const std::vector<T> t{target};
    const Tensor<T> logit(Shape{1}, static_cast<T>(x));
    const auto got = values_and_gradients<T>(
        [&](auto&, const auto& v) { return bce_with_logits<T>(v[0], t); }, {logit}, ones<T>);
    const Real z = logit[0], p = target, e = std::exp(-std::abs(z));
    const Real value = (z > 0 ? z * (1 - p) : -z * p) + std::log1p(e);
    const Real slope = z > 0 ? (1 - p) - e / (1 + e) : e / (1 + e) - p;
    error.compare(got[0][0], value, size_of<T>(value));
    error.compare(got[1][0], slope, relative ? size_of<T>(slope) : 1);
  }
}

// One near-certain label; the other three share the remaining probability.
template <class T>
void compare_entropy(WorstError& error) {
  for (const double sure : {-1e4, -85.0, -20.0, 0.0, 1.0, 10.0, 16.0, 20.0, 40.0, 85.0, 1e4}) {
    const std::vector<std::int32_t> label{1};
    Tensor<T> x(Shape{1, 4}, static_cast<T>(-3));
    x[1] = static_cast<T>(sure - 3);
    const auto got = values_and_gradients<T>(
        [&](auto&, const auto& v) { return softmax_cross_entropy<T>(v[0], label); }, {x}, ones<T>);
    const Real d = static_cast<Real>(x[1]) + 3, others = 3 * std::exp(-std::abs(d)) / (d < 0 ? 9 : 1);
    const Real value = d < 0 ? -d + std::log(Real{3}) + std::log1p(others) : std::log1p(others);
    const Real right = d < 0 ? others / (1 + others) : 1 / (1 + others),
               wrong = d < 0 ? 1 / (1 + others) : others / (1 + others);
    error.compare(got[0][0], value, size_of<T>(value));
    for (std::size_t c = 0; c < 4; ++c) {
      const Real slope = c == 1 ? -wrong : wrong / 3;
      error.compare(got[1][c], slope, size_of<T>(slope));
    }
    const auto p = values_and_gradients<T>([](auto&, const auto& v) { return softmax(v[0]); }, {x}, ones<T>);
    error.compare(p[0][1], right, size_of<T>(right));
    error.compare(p[0][2], wrong / 3, size_of<T>(wrong / 3));
  }
}

// Logits of +-1e30 and a vocabulary of 200,000, with likely and unlikely labels.
template <class T>
void compare_large_entropy(WorstError& error) {
  const auto check = [&](const Tensor<T>& x, std::int32_t label) {
    const std::vector<std::int32_t> labels{label};
    const auto got = values_and_gradients<T>(
        [&](auto&, const auto& v) { return softmax_cross_entropy<T>(v[0], labels); }, {x}, ones<T>);
    const Real most = *std::max_element(x.data.begin(), x.data.end());
    Real z = 0;
    for (const T v : x.data) z += std::exp(v - most);
    const Real value = std::log(z) + (most - x[label]);
    error.compare(got[0][0], value, size_of<T>(value));
    for (Index i = 0; i < x.size(); ++i) {
      const Real slope = std::exp(x[i] - most) / z - (i == label ? 1 : 0);
      error.compare(got[1][static_cast<std::size_t>(i)], slope, size_of<T>(slope));
    }
  };
  const Tensor<T> huge({1, 3}, {T(1e30), T(-1e30), T(1e30)}), wide = scattered<T>({1, 200'000}, -10, 10, 12);
  for (const std::int32_t label : {0, 1, 2}) check(huge, label);
  for (const std::int32_t label : {0, 199'999}) check(wide, label);
}

}  // namespace

void add_elementwise_numerics(std::vector<NumericsCase>& cases) {
  add_sweeps(cases);
  add_numerics(cases, "activation: infinities, largest and least values, NaN", "value", 3e-7, 3e-16,
               [](auto t, WorstError& e) { compare_limits<decltype(t)>(e); });
  add_numerics(cases, "loss: bce_with_logits to +-1e4, certain targets", "value, slope", 2e-7, 3e-16,
               [](auto t, WorstError& e) {
                 compare_bce<decltype(t)>(0, true, e);
                 compare_bce<decltype(t)>(1, true, e);
               });
  add_numerics(cases, "loss: bce_with_logits to +-1e4, target 0.3", "value, 1", 2e-7, 3e-16,
               [](auto t, WorstError& e) { compare_bce(static_cast<decltype(t)>(0.3), false, e); });
  add_numerics(cases, "softmax: cross-entropy of labels certain to 1e4", "value, slope", 5e-7, 5e-16,
               [](auto t, WorstError& e) { compare_entropy<decltype(t)>(e); });
  // The exponentials are added in T in 4 to 16 partial sums, with an error of at most n / 4 u = 3e-3 in
  // float. Measured: 4e-5 with 4 partial sums, 2e-5 with 8.
  add_numerics(cases, "softmax: cross-entropy of +-1e30 and of 200,000 columns", "value, slope", 1e-4, 5e-14,
               [](auto t, WorstError& e) { compare_large_entropy<decltype(t)>(e); });
}

}  // namespace fieldmark
