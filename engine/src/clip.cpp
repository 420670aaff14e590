#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/clip.h>

#include <algorithm>
#include <cmath>

#include "ops/chunks.h"

namespace fieldmark {
namespace {

// largest * root is the norm, which may be beyond double.
struct Norm {
  double largest = 1, root = 0;
  double value() const { return largest * root; }
};

template <class T>
Norm norm_of(std::span<const T> grads) {
  Tape<T> tape;  // for the partial sums
  const auto root_of = [&](double largest) {
    return std::sqrt(
        detail::chunked_sum(tape, static_cast<Index>(grads.size()), [g = grads.data(), largest](Index i) {
          const double x = static_cast<double>(g[i]) / largest;
          return x * x;
        }));
  };
  const double root = root_of(1);
  if (std::isfinite(root)) return {1, root};
  double largest = 0;
  for (const T g : grads) largest = std::max(largest, std::abs(static_cast<double>(g)));
  if (largest == 0 || !std::isfinite(largest)) return {1, root};
  return {largest, root_of(largest)};
}

template <class T>
void scale_to(std::span<T> grads, const Norm& norm, double limit) {
  if (norm.value() <= limit) return;
  const T factor = static_cast<T>(limit / norm.largest / norm.root);
  parallel_for(static_cast<Index>(grads.size()), detail::kGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) grads[at(i)] *= factor;
  });
}

void check_limit(double limit) { check_number("clip_grad_norm", "limit", limit, limit > 0, "positive"); }

template <class T>
[[noreturn]] void refuse(const std::string& where, Index element, T value) {
  throw ValueError("[clip_grad_norm] gradients must be finite, got " + number_text(value) + " at element " +
                   std::to_string(element) + where);
}

}  // namespace

template <class T>
double grad_norm(std::span<const T> grads) {
  return norm_of(grads).value();
}

template <class T>
double clip_grad_norm(std::span<T> grads, double limit) {
  check_limit(limit);
  const Norm norm = norm_of(std::span<const T>(grads));
  if (!std::isfinite(norm.value()))  // numbers that are finite may have such a norm
    for (std::size_t i = 0; i < grads.size(); ++i)
      if (!std::isfinite(grads[i])) refuse("", static_cast<Index>(i), grads[i]);
  scale_to(grads, norm, limit);
  return norm.value();
}

template <class T>
double clip_grad_norm(ParamStore<T>& store, double limit) {
  check_limit(limit);
  const Norm norm = norm_of(std::span<const T>(store.grads()));
  if (!std::isfinite(norm.value()))  // numbers that are finite may have such a norm
    for (const auto& e : store.entries())
      for (Index i = 0; i < e.shape.size(); ++i)
        if (const T g = store.grads()[at(e.offset + i)]; !std::isfinite(g))
          refuse(" of '" + e.name + "'", i, g);
  scale_to(store.grads(), norm, limit);
  return norm.value();
}

template double grad_norm(std::span<const float>);
template double grad_norm(std::span<const double>);
template double clip_grad_norm(std::span<float>, double);
template double clip_grad_norm(std::span<double>, double);
template double clip_grad_norm(ParamStore<float>&, double);
template double clip_grad_norm(ParamStore<double>&, double);

}  // namespace fieldmark
