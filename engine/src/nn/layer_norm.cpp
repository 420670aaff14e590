#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/nn/layer_norm.h>

#include <algorithm>

namespace fieldmark {

template <class T>
LayerNorm<T>::LayerNorm(ParamStore<T>& store, std::string_view name, Index channels, double eps) : eps_(eps) {
  if (channels < 1)
    throw ValueError("[LayerNorm] channels must be at least 1, got " + std::to_string(channels));
  check_number("LayerNorm", "eps", eps, eps > 0, "above 0");
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
