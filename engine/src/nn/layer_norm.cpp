#include <fieldmark/engine/nn/layer_norm.h>

#include <algorithm>

#include "number_text.h"

namespace fieldmark {

template <class T>
LayerNorm<T>::LayerNorm(ParamStore<T>& store, std::string_view name, Index channels, double eps) : eps_(eps) {
  if (channels < 1)
    throw ValueError("[LayerNorm] channels must be at least 1, got " + std::to_string(channels));
  if (!(eps > 0)) throw ValueError("[LayerNorm] eps must be above 0, got " + detail::number_text(eps));
  store.require_free(name, {"gamma", "beta"});
  gamma_ = store.add(std::string(name) + "/gamma", {channels});
  beta_ = store.add(std::string(name) + "/beta", {channels});
  std::ranges::fill(store.values(gamma_), T(1));
}

template <class T>
Var<T> LayerNorm<T>::operator()(const Params<T>& params, Var<T> x) const {
  return layer_norm(x, params.leaf(x.tape(), gamma_), params.leaf(x.tape(), beta_), eps_);
}

template class LayerNorm<float>;
template class LayerNorm<double>;

}  // namespace fieldmark
