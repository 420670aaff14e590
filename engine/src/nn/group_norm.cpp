#include <fieldmark/engine/nn/group_norm.h>

#include <algorithm>

namespace fieldmark {

template <class T>
GroupNorm<T>::GroupNorm(ParamStore<T>& store, std::string_view name, Index channels,
                        const GroupNormOptions& options)
    : options_(options) {
  if (channels < 1 || options.groups < 1 || channels % options.groups != 0)
    throw ValueError("[GroupNorm] channels must be at least 1 and a multiple of groups, got " +
                     std::to_string(channels) + " channels and " + std::to_string(options.groups) +
                     " groups");
  store.require_free(name, {"gamma", "beta"});
  gamma_ = store.add(std::string(name) + "/gamma", {channels});
  beta_ = store.add(std::string(name) + "/beta", {channels});
  std::ranges::fill(store.values(gamma_), T(1));
}

template <class T>
Var<T> GroupNorm<T>::operator()(const Params<T>& params, Var<T> x) const {
  return group_norm(x, params.leaf(x.tape(), gamma_), params.leaf(x.tape(), beta_), options_);
}

template class GroupNorm<float>;
template class GroupNorm<double>;

}  // namespace fieldmark
