#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/nn/batch_norm.h>

#include <algorithm>

namespace fieldmark {

template <class T>
BatchNorm<T>::BatchNorm(ParamStore<T>& store, std::string_view name, Index channels,
                        const BatchNormOptions& options)
    : options_(options) {
  if (channels < 1)
    throw ValueError("[BatchNorm] channels must be at least 1, got " + std::to_string(channels));
  const std::string prefix(name);
  store.require_free(prefix, {"gamma", "beta", "running_mean", "running_variance"});
  gamma_ = store.add(prefix + "/gamma", {channels});
  beta_ = store.add(prefix + "/beta", {channels});
  mean_ = store.add(prefix + "/running_mean", {channels}, ParamRole::running);
  variance_ = store.add(prefix + "/running_variance", {channels}, ParamRole::running);
  std::ranges::fill(store.values(gamma_), T(1));
  std::ranges::fill(store.values(variance_), T(1));
}

template <class T>
Var<T> BatchNorm<T>::operator()(const Params<T>& params, Var<T> x, BatchStatistics* statistics) const {
  return batch_norm(x, params.leaf(x.tape(), gamma_), params.leaf(x.tape(), beta_), options_, statistics);
}

template <class T>
Var<T> BatchNorm<T>::evaluate(const Params<T>& params, Var<T> x) const {
  const auto values = [&](ParamId id) {
    const Var<T> v = params.leaf(x.tape(), id);
    return std::span<const T>(v.value(), static_cast<std::size_t>(v.shape().size()));
  };
  return batch_norm_fixed(x, params.leaf(x.tape(), gamma_), params.leaf(x.tape(), beta_), values(mean_),
                          values(variance_), options_);
}

template <class T>
void BatchNorm<T>::update(ParamStore<T>& store, const BatchStatistics& batch, double momentum) const {
  check_number("BatchNorm", "momentum", momentum, momentum >= 0 && momentum <= 1, "in [0, 1]");
  const auto blend = [&](std::span<T> running, const std::vector<double>& seen) {
    if (running.size() != seen.size())
      throw ShapeError("[BatchNorm] batch must have " + std::to_string(running.size()) + " channels, got " +
                       std::to_string(seen.size()));
    for (std::size_t c = 0; c < seen.size(); ++c)
      running[c] = static_cast<T>((1 - momentum) * static_cast<double>(running[c]) + momentum * seen[c]);
  };
  blend(store.values(mean_), batch.mean);
  blend(store.values(variance_), batch.variance);
}

template class BatchNorm<float>;
template class BatchNorm<double>;

}  // namespace fieldmark
