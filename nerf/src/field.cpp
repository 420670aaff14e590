#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/nerf/field.h>
#include <fieldmark/nerf/spherical_harmonics.h>

namespace fieldmark::nerf {
namespace {

FieldOptions checked(const FieldOptions& o) {
  if (o.kind == FieldKind::mlp) return o;  // its options are checked where they are used
  if (o.width < 1 || o.width > 256)
    throw ValueError("[field] width must be 1 to 256, got " + std::to_string(o.width));
  if (o.geometry < 1 || o.geometry > 256)
    throw ValueError("[field] geometry must be 1 to 256, got " + std::to_string(o.geometry));
  return o;
}

template <class T>
void add_networks(ParamStore<T>& store, const std::string& prefix, const FieldOptions& o, std::uint64_t seed,
                  std::vector<Dense<T>>& density, std::vector<Dense<T>>& colour) {
  const Index features = Index{o.encoding.features} * o.encoding.levels;
  density.emplace_back(store, prefix + "density/0",
                       DenseOptions{.in = features, .out = o.width, .activation = Activation::relu},
                       seed + 1);
  density.emplace_back(store, prefix + "density/1", DenseOptions{.in = o.width, .out = o.geometry}, seed + 2);
  colour.emplace_back(store, prefix + "colour/0",
                      DenseOptions{.in = o.geometry + features + (o.directional ? kSphericalHarmonics : 0),
                                   .out = o.width,
                                   .activation = Activation::relu},
                      seed + 3);
  colour.emplace_back(store, prefix + "colour/1",
                      DenseOptions{.in = o.width, .out = o.width, .activation = Activation::relu}, seed + 4);
  colour.emplace_back(store, prefix + "colour/2", DenseOptions{.in = o.width, .out = 3}, seed + 5);
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
  // The table comes after the networks.
  if (!mlp_) encoding_.emplace(store, before + "hash", options_.encoding, seed);
}

template <class T>
const HashEncoding<T>& Field<T>::encoding() const {
  if (!encoding_) throw ValueError("[field] encoding: expected a field with a hash table, got an mlp field");
  return *encoding_;
}

template <class T>
Index Field<T>::density_width() const {
  return mlp_ ? mlp_->feature_width() : encoding_->width();
}

template <class T>
Index Field<T>::colour_width() const {
  return mlp_ ? 0 : encoding_->width();
}

template <class T>
Index Field<T>::geometry_width() const {
  return mlp_ ? mlp_->geometry_width() : options_.geometry;
}

template <class T>
Index Field<T>::direction_width() const {
  if (mlp_) return mlp_->direction_width();
  return options_.directional ? kSphericalHarmonics : 0;
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
