#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/gather.h>
#include <fieldmark/engine/ops/layer_norm.h>
#include <fieldmark/engine/ops/layout.h>
#include <fieldmark/engine/ops/math.h>
#include <fieldmark/engine/ops/reduce_axes.h>
#include <fieldmark/engine/ops/relu_family.h>

#include <algorithm>
#include <numbers>

#include "numerics_cases_parts.h"

namespace fieldmark {
namespace {

using Real = long double;

Real gelu_of(Real x) { return x * std::erfc(-x / std::numbers::sqrt2_v<Real>) / 2; }
Real gelu_slope(Real x) {
  return std::erfc(-x / std::numbers::sqrt2_v<Real>) / 2 +
         x * std::exp(-x * x / 2) / std::sqrt(2 * std::numbers::pi_v<Real>);
}
Real silu_of(Real x) { return x / (1 + std::exp(-x)); }
Real silu_slope(Real x) { return (1 + x / (1 + std::exp(x))) / (1 + std::exp(-x)); }
Real cos_of(Real x) { return std::cos(x); }
Real minus_sin(Real x) { return -std::sin(x); }
Real sin_of(Real x) { return std::sin(x); }
Real log_of(Real x) { return std::log(x); }
Real reciprocal_of(Real x) { return 1 / x; }
Real log1p_of(Real x) { return std::log1p(x); }
Real log1p_slope(Real x) { return 1 / (1 + x); }
Real expm1_of(Real x) { return std::expm1(x); }
Real sqrt_of(Real x) { return std::sqrt(x); }
Real sqrt_slope(Real x) { return 1 / (2 * std::sqrt(x)); }
Real reciprocal_slope(Real x) { return -1 / (x * x); }
Real elu_of(Real x) { return x > 0 ? x : std::expm1(x); }
Real elu_slope(Real x) { return x > 0 ? 1 : std::exp(x); }
Real exp_value(Real x) { return std::exp(x); }

// Compares y = f(x) at 4001 points of [lo, hi] with its definition and slope, relative to the magnitude of
// each but at least `scale`.
struct Curve {
  double lo, hi;
  Real (*value)(Real), (*slope)(Real);
  Real scale;
};

template <class F>
void add_curve(std::vector<NumericsCase>& cases, const std::string& name, double float_limit,
               double double_limit, const Curve& curve, F op) {
  const std::string relative_to = curve.scale > 0 ? "1" : "value, slope";
  add_numerics(cases, name, relative_to, float_limit, double_limit, [=](auto t, WorstError& error) {
    using T = decltype(t);
    const bool spread = curve.lo > 0;  // over the orders of magnitude
    auto x = scattered<T>({4001}, spread ? std::log(curve.lo) : curve.lo,
                          spread ? std::log(curve.hi) : curve.hi, 5);
    if (spread)
      for (T& v : x.data) v = static_cast<T>(std::exp(static_cast<double>(v)));
    const auto got = values_and_gradients<T>([&](auto&, const auto& v) { return op(v[0]); }, {x}, ones<T>);
    for (std::size_t i = 0; i < x.data.size(); ++i) {
      const Real y = curve.value(x.data[i]), slope = curve.slope(x.data[i]);
      error.compare(got[0][i], y, std::max(size_of<T>(y), curve.scale));
      error.compare(got[1][i], slope, std::max(size_of<T>(slope), curve.scale));
    }
  });
}

void add_curves(std::vector<NumericsCase>& cases) {
  add_curve(cases, "math: log from 1e-30 to 1e6", 3e-7, 4e-16, {1e-30, 1e6, log_of, reciprocal_of, 0},
            [](auto v) { return log(v); });
  add_curve(cases, "math: log1p from -1e-6 to 1e-6", 2e-7, 4e-16, {-1e-6, 1e-6, log1p_of, log1p_slope, 0},
            [](auto v) { return log1p(v); });
  add_curve(cases, "math: expm1 from -1e-6 to 1e-6", 2e-7, 4e-16, {-1e-6, 1e-6, expm1_of, exp_value, 0},
            [](auto v) { return expm1(v); });
  add_curve(cases, "math: sqrt from 1e-37 to 1e37", 1.5e-7, 3e-16, {1e-37, 1e37, sqrt_of, sqrt_slope, 0},
            [](auto v) { return sqrt(v); });
  add_curve(cases, "math: reciprocal from 1e-18 to 1e18", 2e-7, 4e-16,
            {1e-18, 1e18, reciprocal_of, reciprocal_slope, 0}, [](auto v) { return reciprocal(v); });
  add_curve(cases, "math: sin to +-1000", 2e-7, 4e-16, {-1000, 1000, sin_of, cos_of, 1},
            [](auto v) { return sin(v); });
  add_curve(cases, "math: cos to +-1000", 2e-7, 4e-16, {-1000, 1000, cos_of, minus_sin, 1},
            [](auto v) { return cos(v); });
  add_curve(cases, "relu_family: elu from -1e-3 to 1e-3", 2e-7, 4e-16, {-1e-3, 1e-3, elu_of, elu_slope, 0},
            [](auto v) { return elu(v); });
  add_curve(cases, "relu_family: silu from -80 to 80", 8e-7, 2e-15, {-80, 80, silu_of, silu_slope, 1},
            [](auto v) { return silu(v); });
  add_curve(cases, "relu_family: gelu from -12 to 12", 8e-7, 2e-15, {-12, 12, gelu_of, gelu_slope, 1},
            [](auto v) { return gelu(v); });
}

// Sums of 3 million values along either axis of a matrix, relative to the sums.
template <class T>
void compare_axis_sums(WorstError& error) {
  constexpr Index rows = 1'000'000, columns = 3;
  const auto x = scattered<T>({rows, columns}, 0.1, 1, 8);
  std::vector<Real> of_columns(columns);
  for (Index i = 0; i < x.size(); ++i) of_columns[at(i % columns)] += x[i];
  Tape<T> tape;
  const Var<T> tall = sum(tape.constant(x), {0}),
               wide = sum(tape.constant(x.data.data(), {columns, rows}), {1});
  for (Index c = 0; c < columns; ++c) {
    error.compare(tall.value()[c], of_columns[at(c)], of_columns[at(c)]);
    Real row = 0;
    for (Index i = 0; i < rows; ++i) row += x[c * rows + i];
    error.compare(wide.value()[c], row, row);
  }
}

// Logits around +-1e4, and rows with infinite elements, one of them all -infinity.
template <class T>
void compare_logsumexp(WorstError& error) {
  constexpr T inf = std::numeric_limits<T>::infinity();
  const auto check = [&](std::vector<T> row, Real want, std::vector<Real> slopes) {
    const Tensor<T> x({1, static_cast<Index>(row.size())}, row);
    const auto got =
        values_and_gradients<T>([](auto&, const auto& v) { return logsumexp(v[0], {1}); }, {x}, ones<T>);
    error.compare(got[0][0], want, std::isfinite(want) ? size_of<T>(want) : 1);
    for (std::size_t i = 0; i < slopes.size(); ++i)
      error.compare(got[1][i], slopes[i], size_of<T>(slopes[i]));
  };
  const Real log2 = std::log(Real{2});
  check({10000, 10000}, 10000 + log2, {0.5, 0.5});
  check({-10000, -10000}, log2 - 10000, {0.5, 0.5});
  check({-inf, 3, -inf}, 3, {0, 1, 0});
  check({-inf, -inf}, -std::numeric_limits<Real>::infinity(), {0, 0});
  check({inf, 0}, std::numeric_limits<Real>::infinity(), {1, 0});
}

// Rows far from 0, whose variance would be lost in a sum of squares; a constant row gives beta.
template <class T>
void compare_layer_norm(WorstError& error) {
  constexpr Index columns = 64;
  Tensor<T> x = scattered<T>({3, columns}, -1, 1, 4);
  for (Index c = 0; c < columns; ++c) {
    x[columns + c] = x[columns + c] * T(0.25) + T(1000);
    x[2 * columns + c] = T(1e6);
  }
  const Tensor<T> gain = scattered<T>({columns}, 0.5, 2, 5), shift = scattered<T>({columns}, -1, 1, 6);
  const auto got = values_and_gradients<T>([](auto&, const auto& v) { return layer_norm(v[0], v[1], v[2]); },
                                           {x, gain, shift}, ones<T>);
  for (Index r = 0; r < 3; ++r) {
    Real mean = 0, square = 0;
    for (Index c = 0; c < columns; ++c) mean += static_cast<Real>(x[r * columns + c]) / columns;
    for (Index c = 0; c < columns; ++c) square += (x[r * columns + c] - mean) * (x[r * columns + c] - mean);
    for (Index c = 0; c < columns; ++c)
      error.compare(got[0][at(r * columns + c)],
                    gain[c] * (x[r * columns + c] - mean) / std::sqrt(square / columns + 1e-5L) + shift[c],
                    1);
  }
}

// Along either axis, pairs of 1e6 and 1/16 - 1e6: exact in double sums, lost in float sums.
template <class T>
void compare_cancelling_axes(WorstError& error) {
  constexpr Index pairs = 100'000, columns = 3;
  Tensor<T> tall({2 * pairs, columns}), wide({columns, 2 * pairs});
  for (Index i = 0; i < tall.size(); ++i) {
    tall[i] = i / columns % 2 == 0 ? T(1e6) : T(0.0625 - 1e6);
    wide[i] = i % 2 == 0 ? T(1e6) : T(0.0625 - 1e6);
  }
  Tape<T> tape;
  const Var<T> down = sum(tape.constant(tall), {0}), across = sum(tape.constant(wide), {1});
  for (Index c = 0; c < columns; ++c) {
    error.equal(down.value()[c], Real{0.0625} * pairs);
    error.equal(across.value()[c], Real{0.0625} * pairs);
  }
}

// Rows around 1e4, for which E[x^2] - E[x]^2 would keep no digit in float.
template <class T>
void compare_variance(WorstError& error) {
  constexpr Index rows = 4, columns = 1000;
  const Tensor<T> x = scattered<T>({rows, columns}, 9999, 10001, 7);
  const auto got =
      values_and_gradients<T>([](auto&, const auto& v) { return variance(v[0], {1}); }, {x}, ones<T>);
  for (Index r = 0; r < rows; ++r) {
    std::vector<Real> off(columns);  // from 1e4, exact: a mean of 1e4 would be rounded even in long double
    Real mean = 0, square = 0;
    for (Index c = 0; c < columns; ++c) mean += (off[at(c)] = x[r * columns + c] - Real{1e4}) / columns;
    for (Real& o : off) square += (o - mean) * (o - mean);
    error.compare(got[0][at(r)], square / columns, square / columns);
    for (Index c = 0; c < columns; ++c)
      error.compare(got[1][at(r * columns + c)], 2 * (off[at(c)] - mean) / columns, Real{2} / columns);
  }
}

// Sums of a million values of both signs, forward and from the end, relative to the sums of magnitudes.
template <class T>
void compare_cumsum(WorstError& error) {
  constexpr Index n = 1'000'000;
  const Tensor<T> x = scattered<T>({n, 1}, -1, 1, 8), g = scattered<T>({n, 1}, -1, 1, 9);
  const auto got = values_and_gradients<T>([](auto&, const auto& v) { return cumsum(v[0], 0); }, {x},
                                           [&](Shape) -> const Tensor<T>& { return g; });
  const auto check = [&](const std::vector<T>& sums, const Tensor<T>& terms, bool backwards) {
    Real sum = 0, magnitude = 0;
    for (Index k = 0; k < n; ++k) {
      const Index i = backwards ? n - 1 - k : k;
      sum += terms[i];
      magnitude += std::abs(terms[i]);
      error.compare(sums[at(i)], sum, size_of<T>(magnitude));
    }
  };
  check(got[0], x, false);
  check(got[1], g, true);
}

// The gradient of one entry that is gathered 100,000 times, added in T.
template <class T>
void compare_gather(WorstError& error) {
  constexpr Index n = 100'000;
  const std::vector<std::int32_t> index(at(n), 1);
  const Tensor<T> x({2}, {3, 5}), g = scattered<T>({n}, -1, 1, 3);
  const auto got = values_and_gradients<T>(
      [&](auto&, const auto& v) { return gather(v[0], 0, std::span<const std::int32_t>(index)); }, {x},
      [&](Shape) -> const Tensor<T>& { return g; });
  Real sum = 0, magnitude = 0;
  for (const T v : g.data) {
    sum += v;
    magnitude += std::abs(v);
  }
  error.compare(got[1][1], sum, magnitude);
  error.equal(got[1][0], 0);
}

// a^b and both slopes b a^(b - 1) and a^b log a, from 1e-30 to 1e30 and next to 1 with large exponents. The
// rounding of b - 1 costs the first slope |log a| units.
template <class T>
void compare_pow(bool near_one, WorstError& error) {
  constexpr Index n = 4001;
  Tensor<T> a = near_one ? scattered<T>({n}, 0.999, 1.001, 10) : scattered<T>({n}, -30, 30, 10);
  const Tensor<T> b = near_one ? scattered<T>({n}, -1e4, 1e4, 11) : scattered<T>({n}, -0.2, 1.2, 11);
  if (!near_one)
    for (T& v : a.data) v = static_cast<T>(std::pow(10.0, static_cast<double>(v)));
  const auto got =
      values_and_gradients<T>([](auto&, const auto& v) { return pow(v[0], v[1]); }, {a, b}, ones<T>);
  for (Index i = 0; i < n; ++i) {
    const Real x = a[i], p = b[i], y = std::pow(x, p);
    const Real slope = p * std::pow(x, p - 1), log_slope = y * std::log(x);
    error.compare(got[0][at(i)], y, size_of<T>(y));
    error.compare(got[1][at(i)], slope, size_of<T>(slope) * (1 + std::abs(std::log(x))));
    error.compare(got[2][at(i)], log_slope, size_of<T>(log_slope));
  }
}

// Slopes with one factor 0 and the other infinite, and values at the ends of the range.
template <class T>
void compare_edges(WorstError& error) {
  constexpr T nan = std::numeric_limits<T>::quiet_NaN(), top = std::numeric_limits<T>::max();
  const auto check = [&](auto op, std::vector<T> a, std::vector<T> b, std::vector<std::vector<T>> want) {
    const Tensor<T> x({static_cast<Index>(a.size())}, a), z({static_cast<Index>(b.size())}, b);
    const auto got =
        values_and_gradients<T>([&](auto&, const auto& v) { return op(v[0], v[1]); }, {x, z}, ones<T>);
    for (std::size_t k = 0; k < want.size(); ++k)
      for (std::size_t i = 0; i < want[k].size(); ++i) error.equal(got[k][i], want[k][i]);
  };
  check([](auto a, auto b) { return pow(a, b); }, {0, 0, 2, -2}, {0, 2, 0, 2}, {{1, 0, 1, 4}, {0, 0, 0, -4}});
  check([](auto a, auto b) { return div(a, b); }, {top, 0}, {top, top},
        {{1, 0}, {1 / top, 1 / top}, {-1 / top, 0}});
  check([](auto a, auto b) { return maximum(a, b); }, {nan, 1, 3, 2}, {1, nan, 3, 5}, {{nan, nan, 3, 5}});
  check([](auto a, auto b) { return minimum(a, b); }, {nan, 1, 3, 2}, {1, nan, 3, 5}, {{nan, nan, 3, 2}});
}

}  // namespace

void add_tensor_numerics(std::vector<NumericsCase>& cases) {
  add_curves(cases);
  add_numerics(cases, "arithmetic: pow, div, maximum, minimum at the edges", "bits", 0, 0,
               [](auto t, WorstError& e) { compare_edges<decltype(t)>(e); });
  add_numerics(cases, "reduce_axes: three million values along either axis", "value", 6e-8, 1e-15,
               [](auto t, WorstError& e) { compare_axis_sums<decltype(t)>(e); });
  add_numerics(cases, "reduce_axes: logsumexp of +-1e4 and infinities", "value, slope", 1e-7, 3e-16,
               [](auto t, WorstError& e) { compare_logsumexp<decltype(t)>(e); });
  add_numerics(cases, "layer_norm: rows around 1000, constant rows", "1", 2e-6, 1e-12,
               [](auto t, WorstError& e) { compare_layer_norm<decltype(t)>(e); });
  add_numerics(cases, "reduce_axes: pairs that cancel along either axis", "bits", 0, 0,
               [](auto t, WorstError& e) { compare_cancelling_axes<decltype(t)>(e); });
  // The mean is rounded to T: the square of its error, at most 1e4 u, over the variance of 1/3.
  add_numerics(cases, "reduce_axes: variance of 10000 +- 1, gradient", "value, largest slope", 2e-6, 1e-15,
               [](auto t, WorstError& e) { compare_variance<decltype(t)>(e); });
  // Running sums in double, whose rounding errors stay near u relative to the sum of sizes; in float, one
  // rounding.
  add_numerics(cases, "layout: cumsum of a million values, gradient", "sum of sizes", 6e-8, 6e-16,
               [](auto t, WorstError& e) { compare_cumsum<decltype(t)>(e); });
  // Added in T: the sums stay small relative to the sum of sizes, and so do their rounding errors; measured
  // 5e-8 and 1e-16.
  add_numerics(cases, "gather: gradient of an entry taken 100,000 times", "sum of sizes", 2e-7, 5e-16,
               [](auto t, WorstError& e) { compare_gather<decltype(t)>(e); });
  // 2 u from the power and u from each of three products.
  add_numerics(cases, "arithmetic: pow from 1e-30 to 1e30", "value, slopes, |log a|", 3e-7, 6e-16,
               [](auto t, WorstError& e) { compare_pow<decltype(t)>(false, e); });
  add_numerics(cases, "arithmetic: pow next to 1, exponents to 1e4", "value, slopes, |log a|", 3e-7, 6e-16,
               [](auto t, WorstError& e) { compare_pow<decltype(t)>(true, e); });
}

}  // namespace fieldmark
