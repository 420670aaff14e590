#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/columns.h>
#include <fieldmark/nerf/field.h>
#include <fieldmark/nerf/spherical_harmonics.h>

namespace fieldmark::nerf {
namespace {

FieldOptions checked(const FieldOptions& o) {
  if (o.width < 1 || o.width > 256)
    throw ValueError("[field] width must be 1 to 256, got " + std::to_string(o.width));
  if (o.geometry < 1 || o.geometry > 256)
    throw ValueError("[field] geometry must be 1 to 256, got " + std::to_string(o.geometry));
  return o;
}

// Builds the networks and returns how many numbers they have, so that the table can be registered after them.
template <class T>
Index add_networks(ParamStore<T>& store, const FieldOptions& o, std::uint64_t seed,
                   std::vector<Dense<T>>& density, std::vector<Dense<T>>& colour) {
  const Index features = Index{o.encoding.features} * o.encoding.levels, before = store.size();
  density.emplace_back(store, "density/0",
                       DenseOptions{.in = features, .out = o.width, .activation = Activation::relu},
                       seed + 1);
  density.emplace_back(store, "density/1", DenseOptions{.in = o.width, .out = o.geometry}, seed + 2);
  colour.emplace_back(
      store, "colour/0",
      DenseOptions{
          .in = o.geometry + features + kSphericalHarmonics, .out = o.width, .activation = Activation::relu},
      seed + 3);
  colour.emplace_back(store, "colour/1",
                      DenseOptions{.in = o.width, .out = o.width, .activation = Activation::relu}, seed + 4);
  colour.emplace_back(store, "colour/2", DenseOptions{.in = o.width, .out = 3}, seed + 5);
  return store.size() - before;
}

}  // namespace

template <class T>
Field<T>::Field(ParamStore<T>& store, const FieldOptions& options, std::uint64_t seed)
    : options_(checked(options)),
      network_size_(add_networks(store, options_, seed, density_, colour_)),
      encoding_(store, "hash", options_.encoding, seed) {}

template <class T>
Var<T> Field<T>::geometry(const Params<T>& params, Var<T> features) const {
  return density_[1](params, density_[0](params, features));
}

template <class T>
Var<T> Field<T>::density(Var<T> z) const {
  const Var<T> log_density = columns(z, 0, 1);
  return truncated_exp(z.tape().reshape(log_density, {log_density.shape()[0]}));
}

template <class T>
Var<T> Field<T>::colour(const Params<T>& params, Var<T> z, Var<T> features, Var<T> direction) const {
  Var<T> h = concat_columns<T>({z, features, direction});
  for (const auto& layer : colour_) h = layer(params, h);
  return sigmoid(h);
}

template <class T>
typename Field<T>::Output Field<T>::operator()(const Params<T>& params, Var<T> x, Var<T> d) const {
  using Part = typename HashEncoding<T>::Part;
  const Var<T> z = geometry(params, encoding_(params, x, Part::density));
  return {density(z), colour(params, z, encoding_(params, x, Part::colour), spherical_harmonics(d))};
}

template class Field<float>;
template class Field<double>;

}  // namespace fieldmark::nerf
