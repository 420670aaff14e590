#include <fieldmark/watermark/evidence/evidence.h>
#include <fieldmark/watermark/evidence/numerics_cases.h>
#include <fieldmark/watermark/mark/power_budget.h>
#include <fieldmark/watermark/mark/weighted_segments.h>

namespace fieldmark::watermark {
namespace {

using Real = long double;

// P(X >= k) of n fair bits, from Pascal's triangle with each row halved.
void compare_tails(Index n, WorstError& error) {
  std::vector<Real> row(static_cast<std::size_t>(n) + 1);
  row[0] = 1;
  for (std::size_t i = 1; i < row.size(); ++i)
    for (std::size_t j = i + 1; j-- > 0;) row[j] = (row[j] + (j > 0 ? row[j - 1] : 0)) / 2;
  Real tail = 0;
  for (Index k = n; k >= 0; --k) {
    tail += row[static_cast<std::size_t>(k)];
    const Real want = std::max<Real>(tail, std::numeric_limits<double>::min());
    error.compare(p_value_bits(k, n), want, want);
  }
}

// exp(-T^2 / 2) down to the least normal number: a rounding error of T^2 is amplified by T^2 / 2.
void compare_keyed(WorstError& error) {
  for (double t = 0.01; t < 37.6; t += 0.01) {
    const Real want = std::max<Real>(std::exp(-Real{t} * t / 2), std::numeric_limits<double>::min());
    error.compare(keyed_p_value(t), want, want * (1 + Real{t} * t / 2));
  }
}

// The statistic does not depend on the scale of the evidence.
void compare_statistic(WorstError& error) {
  constexpr std::size_t cells = 600;
  const auto signs = scattered<double>({600}, -1, 1, 1), sizes = scattered<double>({600}, -1, 1, 2);
  CellCode code;
  Real sum = 0, squares = 0;
  for (std::size_t c = 0; c < cells; ++c) {
    code.bit.push_back(0);
    code.sign.push_back(signs.data[c] < 0 ? -1 : 1);
    sum += sizes.data[c] * Real{signs.data[c] < 0 ? -1.0L : 1.0L};
    squares += Real{sizes.data[c]} * sizes.data[c];
  }
  for (const double scale : {0x1p-1000, 1.0, 0x1p1000}) {
    auto evidence = sizes.data;
    for (double& s : evidence) s *= scale;
    error.compare(keyed_statistic(evidence, code, Message{{1}}), sum / std::sqrt(squares),
                  std::sqrt(Real{cells}));
  }
}

// A residual of any scale gets the same RMS; 0 stays 0.
template <class T>
void compare_budget(WorstError& error) {
  const std::vector<T> mask(300, T(1));
  const double target = 0.02;
  for (const double size : {0.0, 1e-12, 1e-3, 1.0, 1e6}) {
    const auto x = scattered<T>({300, 3}, -size, size, 3);
    const auto got = values_and_gradients<T>(
        [&](auto&, const auto& v) { return power_budget<T>(v[0], mask, target); }, {x}, ones<T>);
    Real squares = 0;
    for (const T v : x.data) squares += static_cast<Real>(v) * v;
    const Real rms = std::sqrt(squares / 900 + 1e-12L);
    for (std::size_t i = 0; i < x.data.size(); ++i)
      error.compare(got[0][i], x.data[i] * target / rms, target);
    for (const T v : got[1]) error.equal(std::isfinite(v), true);
  }
}

// 4096 samples of one pixel, relative to the sum of the terms' sizes.
template <class T>
void compare_segments(WorstError& error) {
  const std::vector<std::int32_t> begin{0, 0, 4096, 4096};
  const auto x = scattered<T>({4096, 3}, -1, 1, 4), w = scattered<T>({4096}, 0, 1e-3, 5);
  const auto got = values_and_gradients<T>(
      [&](auto&, const auto& v) { return weighted_segments<T>(v[0], begin, w.data); }, {x}, ones<T>);
  for (std::size_t c = 0; c < 3; ++c) {
    Real sum = 0, size = 0;
    for (std::size_t k = 0; k < 4096; ++k) {
      sum += static_cast<Real>(w.data[k]) * x.data[3 * k + c];
      size += std::abs(static_cast<Real>(w.data[k]) * x.data[3 * k + c]);
      error.equal(got[1][3 * k + c], w.data[k]);
    }
    error.compare(got[0][3 + c], sum, size);
    error.equal(got[0][c], 0);
    error.equal(got[0][6 + c], 0);
  }
}

NumericsCase in_double(const char* name, const char* relative_to, double limit,
                       void (*compare)(WorstError&)) {
  return {name, "double", relative_to, limit, [compare] {
            WorstError e;
            compare(e);
            return e;
          }};
}

}  // namespace

std::vector<NumericsCase> numerics_cases() {
  std::vector<NumericsCase> all;
  all.push_back(in_double("evidence: p-values of 0 to 255 matching bits", "value", 4e-16, [](WorstError& e) {
    for (const Index n : {0, 1, 2, 7, 16, 48, 64, 255}) compare_tails(n, e);
  }));
  all.push_back(in_double("evidence: p-values of 0 to 3000 matching bits", "value", 4e-16,
                          [](WorstError& e) { compare_tails(3000, e); }));
  all.push_back(in_double("evidence: keyed p-values to 1e-308", "value (1 + T^2 / 2)", 1e-15, compare_keyed));
  all.push_back(in_double("evidence: statistic of evidence from 2^-1000 to 2^1000", "largest T", 1e-15,
                          compare_statistic));
  add_numerics(all, "power_budget: residuals from 0 to 1e6", "mark_psnr", 4e-7, 2e-15,
               [](auto t, WorstError& e) { compare_budget<decltype(t)>(e); });
  add_numerics(all, "weighted_segments: 4096 samples of a pixel", "sum of sizes", 1e-7, 4e-16,
               [](auto t, WorstError& e) { compare_segments<decltype(t)>(e); });
  return all;
}

}  // namespace fieldmark::watermark
