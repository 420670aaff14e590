#include "fieldmark/extractor/pooled_extractor.h"

#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/shape_checks.h>

#include <algorithm>
#include <string>

#include "fieldmark/extractor/centred_image.h"
#include "layer_seed.h"

namespace fieldmark::extractor {

namespace {

constexpr double kMeanOfRelu = 0.3989;  // of a standard normal number: the initial mean output of a block

// Channel b gives bit b: logit = 2 N_b (mean - kMeanOfRelu). If each bit has a share 1 / N_b of an image, a
// channel that separates its values there moves the logit by about one.
template <class T>
void read_own_channel(ParamStore<T>& store, const std::string& linear, Index bits) {
  const double gain = 2 * static_cast<double>(bits);
  const std::span<T> weight = store.values(store.find(linear + "/weight")),
                     bias = store.values(store.find(linear + "/bias"));
  std::ranges::fill(weight, T(0));
  for (Index b = 0; b < bits; ++b) weight[at(b * bits + b)] = static_cast<T>(gain);
  std::ranges::fill(bias, static_cast<T>(-gain * kMeanOfRelu));
}

}  // namespace

template <class T>
PooledExtractor<T>::PooledExtractor(ParamStore<T>& store, std::string_view name,
                                    const PooledExtractorOptions& o, std::uint64_t seed)
    : channels_(o.channels) {
  if (o.n_bits < 1 || o.channels < 1 || o.layers < 1)
    throw ValueError("[PooledExtractor] n_bits, channels and layers must be at least 1, got " +
                     std::to_string(o.n_bits) + ", " + std::to_string(o.channels) + " and " +
                     std::to_string(o.layers));
  LayerSeeds seeds(seed);
  for (Index k = 0; k < o.layers; ++k) {
    const std::string prefix = std::string(name) + "/" + std::to_string(k);
    const Index in = k == 0 ? 3 : o.channels, out = k + 1 == o.layers ? o.n_bits : o.channels;
    convs_.emplace_back(store, prefix + "/conv", Conv2dOptions{.in = in, .out = out}, seeds.next());
    norms_.emplace_back(store, prefix + "/norm", out, BatchNormOptions{.relu = true});
  }
  linear_.emplace_back(store, std::string(name) + "/linear", DenseOptions{.in = o.n_bits, .out = o.n_bits},
                       seeds.next());
  read_own_channel(store, std::string(name) + "/linear", o.n_bits);
}

template <class T>
template <class Norm>
typename PooledExtractor<T>::Blocks PooledExtractor<T>::blocks(const Params<T>& params, Var<T> images,
                                                               Norm norm) const {
  check_rank("PooledExtractor", "images", images.shape(), 4, "[images, height, width, 3]");
  check_extent("PooledExtractor", "images", images.shape(), 3, 3, "red, green, blue");
  const Var<T> centred = centred_image(images);
  Blocks x{.before = centred, .last = centred};
  for (std::size_t k = 0; k < convs_.size(); ++k)
    x = {.before = x.last, .last = norm(k, convs_[k](params, x.last))};
  return x;
}

template <class T>
typename PooledExtractor<T>::Blocks PooledExtractor<T>::trained_blocks(
    const Params<T>& params, Var<T> images, std::vector<BatchStatistics>* statistics) const {
  if (statistics) statistics->resize(norms_.size());
  return blocks(params, images, [&](std::size_t k, Var<T> x) {
    return norms_[k](params, x, statistics ? &(*statistics)[k] : nullptr);
  });
}

template <class T>
Var<T> PooledExtractor<T>::operator()(const Params<T>& params, Var<T> images,
                                      std::vector<BatchStatistics>* statistics) const {
  return linear_[0](params, global_avg_pool(trained_blocks(params, images, statistics).last));
}

template <class T>
typename PooledExtractor<T>::Places PooledExtractor<T>::places(
    const Params<T>& params, Var<T> images, std::vector<BatchStatistics>* statistics) const {
  const Blocks x = trained_blocks(params, images, statistics);
  const auto rows = [](Var<T> map) {
    const Index channels = map.shape()[3];
    return map.tape().reshape(map, {map.shape().size() / channels, channels});
  };
  return {.features = rows(x.before),
          .pixels = linear_[0](params, rows(x.last)),
          .images = linear_[0](params, global_avg_pool(x.last))};
}

template <class T>
Var<T> PooledExtractor<T>::evaluate(const Params<T>& params, Var<T> images) const {
  const Blocks x =
      blocks(params, images, [&](std::size_t k, Var<T> y) { return norms_[k].evaluate(params, y); });
  return linear_[0](params, global_avg_pool(x.last));
}

template <class T>
void PooledExtractor<T>::update(ParamStore<T>& store, std::span<const BatchStatistics> batch,
                                double momentum) const {
  if (batch.size() != norms_.size())
    throw ShapeError("[PooledExtractor] batch must have one entry for each of the " +
                     std::to_string(norms_.size()) + " layers, got " + std::to_string(batch.size()));
  for (std::size_t k = 0; k < batch.size(); ++k) norms_[k].update(store, batch[k], momentum);
}

template class PooledExtractor<float>;
template class PooledExtractor<double>;

}  // namespace fieldmark::extractor
