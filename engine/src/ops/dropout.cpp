#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/ops/dropout.h>

#include <cmath>
#include <string>

#include "ops/chunks.h"

namespace fieldmark {
namespace {

// Factors 0 or 1 / (1 - p) of n elements. Four share a block of random words; a chunk holds whole blocks.
template <class T>
const T* dropout_factors(Tape<T>& tape, Index n, double p, const CounterRng& rng, std::uint64_t step) {
  static_assert(detail::kGrain % 4 == 0);
  T* factor = tape.scratch(n);
  const double limit = std::ldexp(p, 32);
  const T kept = static_cast<T>(1 / (1 - p));
  parallel_for(n, detail::kGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; i += 4) {
      const auto words = rng.bits(step, static_cast<std::uint64_t>(i / 4));
      for (Index k = i; k < std::min(i + 4, end); ++k)
        factor[k] = static_cast<double>(words[at(k - i)]) >= limit ? kept : T(0);
    }
  });
  return factor;
}

}  // namespace

template <class T>
Var<T> dropout(Var<T> x, double p, const CounterRng& rng, std::uint64_t step) {
  check_number("dropout", "p", p, p >= 0 && p < 1, "in [0, 1)");
  if (p == 0) return x;
  const Index n = x.shape().size();
  const T* factor = dropout_factors(x.tape(), n, p, rng, step);
  T* y = nullptr;
  const Var<T> out = x.tape().output(x.shape(), &y, {x});
  parallel_for(n, detail::kGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) y[i] = factor[i] * x.value()[i];
  });

  // dx_i = dy_i times the factor of x_i. A chunk owns its elements.
  x.tape().on_backward(
      out, [x, factor](const T* dy) { detail::add_gradient(x, [=](Index i) { return factor[i] * dy[i]; }); });
  return out;
}

template Var<float> dropout(Var<float>, double, const CounterRng&, std::uint64_t);
template Var<double> dropout(Var<double>, double, const CounterRng&, std::uint64_t);

}  // namespace fieldmark
