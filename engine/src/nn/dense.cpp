#include <fieldmark/engine/nn/dense.h>

#include "nn/initial.h"

namespace fieldmark {

template <class T>
Dense<T>::Dense(ParamStore<T>& store, std::string_view name, const DenseOptions& options, std::uint64_t seed)
    : options_(options) {
  if (options.in < 1 || options.out < 1)
    throw ValueError("[dense] in and out must be at least 1, got in " + std::to_string(options.in) +
                     " and out " + std::to_string(options.out));
  weight_ = store.add(std::string(name) + "/weight", {options.in, options.out}, ParamRole::matrix);
  if (options.bias) bias_ = store.add(std::string(name) + "/bias", {options.out});
  detail::he_uniform(store.values(weight_), options.in, seed);
}

template <class T>
Var<T> Dense<T>::operator()(const Params<T>& params, Var<T> x) const {
  return dense(x, params.leaf(x.tape(), weight_),
               detail::bias_or_zeros(x.tape(), params, bias_, options_.out), options_.activation);
}

template class Dense<float>;
template class Dense<double>;

}  // namespace fieldmark
