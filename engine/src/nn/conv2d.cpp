#include <fieldmark/engine/nn/conv2d.h>

#include "nn/initial.h"

namespace fieldmark {

template <class T>
Conv2d<T>::Conv2d(ParamStore<T>& store, std::string_view name, const Conv2dOptions& o, std::uint64_t seed)
    : options_(o) {
  if (o.in < 1 || o.out < 1 || o.kernel < 1 || o.stride < 1)
    throw ValueError("[conv2d] in, out, kernel and stride must be at least 1, got in " +
                     std::to_string(o.in) + ", out " + std::to_string(o.out) + ", kernel " +
                     std::to_string(o.kernel) + " and stride " + std::to_string(o.stride));
  if (!o.padding && o.kernel % 2 == 0)
    throw ValueError("[conv2d] kernel must be odd where padding is not given, got " +
                     std::to_string(o.kernel));
  if (o.padding && *o.padding < 0)
    throw ValueError("[conv2d] padding must be at least 0, got " + std::to_string(*o.padding));
  store.require_free(name, {"weight", "bias"});
  weight_ = store.add(std::string(name) + "/weight", {o.kernel, o.kernel, o.in, o.out});
  if (o.bias) bias_ = store.add(std::string(name) + "/bias", {o.out});
  detail::he_uniform(store.values(weight_), o.kernel * o.kernel * o.in, seed);
}

template <class T>
Var<T> Conv2d<T>::operator()(const Params<T>& params, Var<T> x) const {
  const ConvWindow window{.stride = options_.stride,
                          .padding = options_.padding.value_or(options_.kernel / 2)};
  return conv2d(x, params.leaf(x.tape(), weight_),
                detail::bias_or_zeros(x.tape(), params, bias_, options_.out), window, options_.activation);
}

template class Conv2d<float>;
template class Conv2d<double>;

}  // namespace fieldmark
