#include "conv_block.h"

#include <string>

namespace fieldmark::baselines {

template <class T>
void update_statistics(ParamStore<T>& store, const NormPass<T>& pass, double momentum) {
  for (const auto& [norm, statistics] : pass.seen) norm->update(store, statistics, momentum);
}

template <class T>
ConvBlock<T>::ConvBlock(ParamStore<T>& store, std::string_view name, Index in, Index out, std::uint64_t seed,
                        bool relu)
    : conv_(store, std::string(name) + "/conv", Conv2dOptions{.in = in, .out = out}, seed),
      norm_(store, std::string(name) + "/norm", out, BatchNormOptions{.relu = relu}) {}

template <class T>
Var<T> ConvBlock<T>::operator()(const Params<T>& params, Var<T> x, NormPass<T>& pass) const {
  const Var<T> sums = conv_(params, x);
  if (pass.running) return norm_.evaluate(params, sums);
  pass.seen.emplace_back(&norm_, BatchStatistics{});
  return norm_(params, sums, &pass.seen.back().second);
}

template void update_statistics(ParamStore<float>&, const NormPass<float>&, double);
template void update_statistics(ParamStore<double>&, const NormPass<double>&, double);
template class ConvBlock<float>;
template class ConvBlock<double>;

}  // namespace fieldmark::baselines
