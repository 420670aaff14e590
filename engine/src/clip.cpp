#include <fieldmark/core/error.h>
#include <fieldmark/engine/clip.h>

#include <cmath>

#include "ops/chunks.h"

namespace fieldmark {
namespace {

template <class T>
void scale_to(std::span<T> grads, double norm, double limit) {
  if (norm <= limit) return;
  const T factor = static_cast<T>(limit / norm);
  parallel_for(static_cast<Index>(grads.size()), detail::kGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) grads[at(i)] *= factor;
  });
}

void check_limit(double limit) {
  if (!(limit > 0)) throw ValueError("[clip_grad_norm] limit must be positive, got " + std::to_string(limit));
}

template <class T>
[[noreturn]] void refuse(const std::string& where, Index element, T value) {
  throw ValueError("[clip_grad_norm] gradients must be finite, got " + std::to_string(value) +
                   " at element " + std::to_string(element) + where);
}

}  // namespace

template <class T>
double grad_norm(std::span<const T> grads) {
  Tape<T> tape;  // for the partial sums
  return std::sqrt(detail::chunked_sum(tape, static_cast<Index>(grads.size()), [g = grads.data()](Index i) {
    return static_cast<double>(g[i]) * static_cast<double>(g[i]);
  }));
}

template <class T>
double clip_grad_norm(std::span<T> grads, double limit) {
  check_limit(limit);
  const double norm = grad_norm(std::span<const T>(grads));
  if (!std::isfinite(norm))
    for (std::size_t i = 0; i < grads.size(); ++i)
      if (!std::isfinite(grads[i])) refuse("", static_cast<Index>(i), grads[i]);
  scale_to(grads, norm, limit);
  return norm;
}

template <class T>
double clip_grad_norm(ParamStore<T>& store, double limit) {
  check_limit(limit);
  const double norm = grad_norm(std::span<const T>(store.grads()));
  if (!std::isfinite(norm))
    for (const auto& e : store.entries())
      for (Index i = 0; i < e.shape.size(); ++i)
        if (const T g = store.grads()[at(e.offset + i)]; !std::isfinite(g))
          refuse(" of '" + e.name + "'", i, g);
  scale_to(store.grads(), norm, limit);
  return norm;
}

template double grad_norm(std::span<const float>);
template double grad_norm(std::span<const double>);
template double clip_grad_norm(std::span<float>, double);
template double clip_grad_norm(std::span<double>, double);
template double clip_grad_norm(ParamStore<float>&, double);
template double clip_grad_norm(ParamStore<double>&, double);

}  // namespace fieldmark
