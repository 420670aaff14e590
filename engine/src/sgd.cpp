#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/sgd.h>

#include "optimiser_checks.h"

namespace fieldmark {

template <class T>
Sgd<T>::Sgd(Index n, SgdOptions o) : options_(o), trained_{{0, n}} {
  check_number("Sgd", "n", n, n >= 0, "at least 0");
  check_number("Sgd", "lr", o.lr, o.lr > 0, "positive");
  check_number("Sgd", "momentum", o.momentum, o.momentum >= 0 && o.momentum < 1, "in [0, 1)");
  check_number("Sgd", "weight_decay", o.weight_decay, o.weight_decay >= 0, "at least 0");
  velocity_.resize(at(n));
}

template <class T>
Sgd<T>::Sgd(const ParamStore<T>& store, SgdOptions o) : Sgd(store.size(), o) {
  trained_.clear();
  for (const auto& e : store.entries())
    if (is_trained(e.role)) trained_.emplace_back(e.offset, e.offset + e.shape.size());
}

template <class T>
void Sgd<T>::step(std::span<T> values, std::span<const T> grads, double lr_factor) {
  detail::check_step_size("Sgd", "values", values.size(), velocity_.size());
  detail::check_step_size("Sgd", "grads", grads.size(), velocity_.size());
  const T lr = static_cast<T>(options_.lr * lr_factor), momentum = static_cast<T>(options_.momentum),
          decay = static_cast<T>(options_.weight_decay);
  constexpr Index kGrain = Index{1} << 15;
  for (const auto& [first, end] : trained_)
    parallel_for(end - first, kGrain, [&, begin = first](Index i0, Index i1) {
      T *x = values.data() + begin, *u = velocity_.data() + begin;
      const T* g = grads.data() + begin;
      for (Index i = i0; i < i1; ++i) {
        const T slope = g[i] + decay * x[i];
        u[i] = momentum * u[i] + slope;
        x[i] -= lr * (options_.nesterov ? slope + momentum * u[i] : u[i]);
      }
    });
}

template class Sgd<float>;
template class Sgd<double>;

}  // namespace fieldmark
