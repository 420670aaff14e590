#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/nerf/field.h>

#include "checks.h"

namespace fieldmark::nerf {
namespace {

FieldOptions checked(const FieldOptions& o) {
  if (o.kind == FieldKind::mlp) return o;  // MlpField checks its options
  check_range("field", "width", o.width, 1, 256);
  check_range("field", "geometry", o.geometry, 1, 256);
  return o;
}

template <class T>
void add_networks(ParamStore<T>& store, const std::string& prefix, const FieldOptions& o, std::uint64_t seed,
                  std::vector<Dense<T>>& density, std::vector<Dense<T>>& colour) {
  const auto add = [&](std::vector<Dense<T>>& layers, const char* part, Index in, Index out, bool relu) {
    const std::string name = prefix + part + std::to_string(layers.size());
    const Activation activation = relu ? Activation::relu : Activation::none;
    layers.emplace_back(store, name, DenseOptions{.in = in, .out = out, .activation = activation}, ++seed);
  };
  const Index features = Index{o.encoding.features} * o.encoding.levels;
  add(density, "density/", features, o.width, true);
  add(density, "density/", o.width, o.geometry, false);
  add(colour, "colour/", o.geometry + features + (o.directional ? kSphericalHarmonics : 0), o.width, true);
  add(colour, "colour/", o.width, o.width, true);
  add(colour, "colour/", o.width, 3, false);
}

}  // namespace

template <class T>
Field<T>::Field(ParamStore<T>& store, const FieldOptions& options, std::uint64_t seed,
                std::string_view prefix)
    : options_(checked(options)) {
  const std::string before(prefix);
  const Index size = store.size();
  if (options_.kind == FieldKind::mlp)
    mlp_.emplace(store, before, options_.mlp, seed);
  else
    add_networks(store, before, options_, seed, density_, colour_);
  network_size_ = store.size() - size;
  if (!mlp_) encoding_.emplace(store, before + "hash", options_.encoding, seed);
}

template <class T>
const HashEncoding<T>& Field<T>::encoding() const {
  if (!encoding_) throw ValueError("[field] encoding: expected a field with a hash table, got an mlp field");
  return *encoding_;
}

template <class T>
void Field<T>::encode(const ParamStore<T>& store, const T* x, Index n, T* density, T* colour,
                      const PackedWeights<T>* packed) const {
  if (mlp_) return mlp_->encode(x, n, density);
  if constexpr (std::is_same_v<T, float>)
    if (const std::uint16_t* rounded = packed ? packed->table(encoding_->table()) : nullptr)
      return encoding_->encode(rounded, x, n, density, colour);
  encoding_->encode(store.values(encoding_->table()), x, n, density, colour);
}

template <class T>
Var<T> Field<T>::geometry(const Params<T>& params, Var<T> features) const {
  if (mlp_) return mlp_->geometry(params, features);
  return density_[1](params, density_[0](params, features));
}

template <class T>
Var<T> Field<T>::density(Var<T> z) const {
  const Var<T> log_density = slice(z, 0, 1);
  return truncated_exp(z.tape().reshape(log_density, {log_density.shape()[0]}));
}

template <class T>
Var<T> Field<T>::encode_directions(Var<T> d) const {
  if (mlp_) return mlp_->encode_directions(d);
  return options_.directional ? spherical_harmonics(d) : slice(d, 0, 0);
}

template <class T>
Var<T> Field<T>::colour(const Params<T>& params, Var<T> z, Var<T> features, Var<T> direction) const {
  if (mlp_) return mlp_->colour(params, z, direction);
  Var<T> h = concatenate<T>({z, features, direction});
  for (const auto& layer : colour_) h = layer(params, h);
  return sigmoid(h);
}

template <class T>
typename Field<T>::Output Field<T>::operator()(const Params<T>& params, Var<T> x, Var<T> d) const {
  using Part = typename HashEncoding<T>::Part;
  const Var<T> z = geometry(params, mlp_ ? mlp_->encode(x) : (*encoding_)(params, x, Part::density));
  const Var<T> features = mlp_ ? x : (*encoding_)(params, x, Part::colour);
  return {density(z), colour(params, z, features, encode_directions(d))};
}

template class Field<float>;
template class Field<double>;

}  // namespace fieldmark::nerf
