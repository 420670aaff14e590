#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/sgd.h>

#include <string>

namespace fieldmark {
namespace {

void require(const char* name, double value, bool ok, const char* want) {
  if (!ok)
    throw ValueError("[Sgd] " + std::string(name) + " must be " + want + ", got " + std::to_string(value));
}

void require_size(const char* name, std::size_t got, std::size_t want) {
  if (got != want)
    throw ShapeError("[Sgd::step] " + std::string(name) + " must have " + std::to_string(want) +
                     " elements, as the optimiser, got " + std::to_string(got));
}

}  // namespace

template <class T>
Sgd<T>::Sgd(Index n, SgdOptions o) : options_(o), trained_{{0, n}} {
  require("n", static_cast<double>(n), n >= 0, "at least 0");
  require("lr", o.lr, o.lr > 0, "positive");
  require("momentum", o.momentum, o.momentum >= 0 && o.momentum < 1, "in [0, 1)");
  require("weight_decay", o.weight_decay, o.weight_decay >= 0, "at least 0");
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
  require_size("values", values.size(), velocity_.size());
  require_size("grads", grads.size(), velocity_.size());
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
