#include <fieldmark/engine/nn/conv2d.h>

#include "nn/initial.h"

namespace fieldmark {

template <class T>
Conv2d<T>::Conv2d(ParamStore<T>& store, std::string_view name, const Conv2dOptions& o, std::uint64_t seed)
    : options_(o) {
  if (o.in < 1 || o.out < 1 || o.kernel < 1 || o.kernel % 2 == 0)
    throw ValueError("[conv2d] in and out must be at least 1 and kernel odd, got in " + std::to_string(o.in) +
                     ", out " + std::to_string(o.out) + " and kernel " + std::to_string(o.kernel));
  weight_ = store.add(std::string(name) + "/weight", {o.kernel, o.kernel, o.in, o.out});
  bias_ = store.add(std::string(name) + "/bias", {o.out});
  detail::he_uniform(store.values(weight_), o.kernel * o.kernel * o.in, seed);
}

template <class T>
Var<T> Conv2d<T>::operator()(const Params<T>& params, Var<T> x) const {
  return conv2d(x, params.leaf(x.tape(), weight_), params.leaf(x.tape(), bias_), options_.activation);
}

template class Conv2d<float>;
template class Conv2d<double>;

}  // namespace fieldmark
