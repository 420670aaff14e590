#include "fieldmark/extractor/pooled_extractor.h"

#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/shape_checks.h>

#include <string>

#include "fieldmark/extractor/centred_image.h"
#include "layer_seed.h"

namespace fieldmark::extractor {

template <class T>
PooledExtractor<T>::PooledExtractor(ParamStore<T>& store, std::string_view name,
                                    const PooledExtractorOptions& o, std::uint64_t seed) {
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
}

template <class T>
template <class Norm>
Var<T> PooledExtractor<T>::run(const Params<T>& params, Var<T> images, Norm norm) const {
  check_rank("PooledExtractor", "images", images.shape(), 4, "[images, height, width, 3]");
  check_extent("PooledExtractor", "images", images.shape(), 3, 3, "red, green, blue");
  Var<T> x = centred_image(images);
  for (std::size_t k = 0; k < convs_.size(); ++k) x = norm(k, convs_[k](params, x));
  return linear_[0](params, global_avg_pool(x));
}

template <class T>
Var<T> PooledExtractor<T>::operator()(const Params<T>& params, Var<T> images,
                                      std::vector<BatchStatistics>* statistics) const {
  if (statistics) statistics->resize(norms_.size());
  return run(params, images, [&](std::size_t k, Var<T> x) {
    return norms_[k](params, x, statistics ? &(*statistics)[k] : nullptr);
  });
}

template <class T>
Var<T> PooledExtractor<T>::evaluate(const Params<T>& params, Var<T> images) const {
  return run(params, images, [&](std::size_t k, Var<T> x) { return norms_[k].evaluate(params, x); });
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
