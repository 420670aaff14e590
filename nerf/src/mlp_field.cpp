#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/nerf/frequency_encoding.h>
#include <fieldmark/nerf/mlp_field.h>

#include <algorithm>
#include <array>

#include "checks.h"

namespace fieldmark::nerf {
namespace {

constexpr Index kMlpBlock = 32, kMostBands = 20;

MlpFieldOptions checked(const MlpFieldOptions& o) {
  check_range("mlp_field", "layers", o.layers, 1, 16);
  check_range("mlp_field", "width", o.width, 2, 1024);
  check_range("mlp_field", "skip", o.skip, 0, o.layers - 1);
  check_range("mlp_field", "position_bands", o.position_bands, 1, kMostBands);
  check_range("mlp_field", "direction_bands", o.direction_bands, 1, kMostBands);
  return o;
}

// p and its frequencies.
template <class T>
Var<T> with_frequencies(Var<T> p, int bands) {
  return concatenate<T>({p, frequency_encoding(p, bands)});
}

}  // namespace

template <class T>
MlpField<T>::MlpField(ParamStore<T>& store, std::string_view prefix, const MlpFieldOptions& options,
                      std::uint64_t seed)
    : options_(checked(options)) {
  const auto add = [&](std::vector<Dense<T>>& layers, const char* part, Index in, Index out,
                       Activation activation) {
    const std::string name = std::string(prefix) + part + "/" + std::to_string(layers.size());
    layers.emplace_back(store, name, DenseOptions{.in = in, .out = out, .activation = activation}, ++seed);
  };
  const Index width = options_.width, features = feature_width();
  for (Index l = 0; l < options_.layers; ++l) {
    const Index before = l == 0 ? features : l == options_.skip ? features + width : width;
    add(density_, "density", before, width, Activation::relu);
  }
  add(density_, "density", width, 1, Activation::none);
  add(colour_, "colour", width, width, Activation::none);
  add(colour_, "colour", width + direction_width(), width / 2, Activation::relu);
  add(colour_, "colour", width / 2, 3, Activation::none);
}

template <class T>
Var<T> MlpField<T>::encode(Var<T> x) const {
  const Index n = x.shape().size();
  T* one = x.tape().scratch(n);
  std::fill_n(one, n, T(1));
  return with_frequencies(sub(scale(x, 2), x.tape().constant(one, x.shape())), options_.position_bands);
}

template <class T>
void MlpField<T>::encode(const T* x, Index n, T* features) const {
  const Index bands = 6 * options_.position_bands, row = feature_width();
  std::array<T, 3 * kMlpBlock> p;
  std::array<T, 6 * kMostBands * kMlpBlock> waves;
  for (Index begin = 0; begin < n; begin += kMlpBlock) {
    const Index count = std::min(kMlpBlock, n - begin);
    for (Index i = 0; i < 3 * count; ++i) p[static_cast<std::size_t>(i)] = 2 * x[3 * begin + i] - 1;
    frequency_values(p.data(), count, 3, options_.position_bands, waves.data());
    for (Index i = 0; i < count; ++i) {
      T* to = features + (begin + i) * row;
      std::copy_n(p.data() + 3 * i, 3, to);
      std::copy_n(waves.data() + i * bands, bands, to + 3);
    }
  }
}

template <class T>
Var<T> MlpField<T>::encode_directions(Var<T> d) const {
  return with_frequencies(d, options_.direction_bands);
}

template <class T>
Var<T> MlpField<T>::geometry(const Params<T>& params, Var<T> features) const {
  Var<T> h = features;
  for (Index l = 0; l < options_.layers; ++l) {
    if (l > 0 && l == options_.skip) h = concatenate<T>({features, h});
    h = density_[at(l)](params, h);
  }
  return concatenate<T>({density_.back()(params, h), h});
}

template <class T>
Var<T> MlpField<T>::colour(const Params<T>& params, Var<T> z, Var<T> direction) const {
  const Var<T> feature = colour_[0](params, slice(z, 1, options_.width));
  const Var<T> h = colour_[1](params, concatenate<T>({feature, direction}));
  return sigmoid(colour_[2](params, h));
}

template class MlpField<float>;
template class MlpField<double>;

}  // namespace fieldmark::nerf
