#include "fieldmark/extractor/dense_extractor.h"

#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/ops/resample.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/engine/shape_checks.h>

#include <array>
#include <string>

#include "fieldmark/extractor/centred_image.h"
#include "layer_seed.h"

namespace fieldmark::extractor {
namespace {

constexpr Index kLeastSide = 16;  // pixels: one at the coarsest level

void check_image(const Shape& s) {
  check_rank("DenseExtractor", "image", s, 4, "[1, height, width, 3]");
  check_extent("DenseExtractor", "image", s, 0, 1, "one image a pass");
  check_extent("DenseExtractor", "image", s, 3, 3, "red, green, blue");
  if (s[1] < kLeastSide || s[2] < kLeastSide)
    throw ShapeError(
        "[DenseExtractor] image: height and width must be at least 16 (four levels), got shape " + s.str());
}

}  // namespace

template <class T>
DenseExtractor<T>::DenseExtractor(ParamStore<T>& store, std::string_view name, const DenseExtractorOptions& o,
                                  std::uint64_t seed) {
  if (o.classes < 2)
    throw ValueError("[DenseExtractor] classes must be at least 2 (a cell and the background), got " +
                     std::to_string(o.classes));
  if (o.base < 8 || o.base % 8 != 0)
    throw ValueError("[DenseExtractor] base must be a positive multiple of 8, got " + std::to_string(o.base));
  LayerSeeds seeds(seed);
  const auto block = [&](const std::string& part, Index in, Index out) {
    const std::string prefix = std::string(name) + "/" + part;
    return Block{.conv = {store, prefix + "/conv", {.in = in, .out = out}, seeds.next()},
                 .norm = {store, prefix + "/norm", out, {.groups = 8, .relu = true}}};
  };
  const Index b = o.base, widths[] = {b, 2 * b, 3 * b, 3 * b};
  Index in = 12;
  for (int level = 0; level < 4; ++level)
    for (int k = 0; k < 2; ++k) {
      down_.push_back(block("down" + std::to_string(2 * level + k), in, widths[level]));
      in = widths[level];
    }
  up_.push_back(block("up0", 6 * b, 3 * b));
  up_.push_back(block("up1", 5 * b, 2 * b));
  const auto head = [&](const char* part, Index out, Activation activation) {
    heads_.emplace_back(store, std::string(name) + "/" + part,
                        DenseOptions{.in = 2 * b, .out = out, .activation = activation}, seeds.next());
  };
  head("sign", 1, Activation::none);
  head("index_hidden", 2 * b, Activation::relu);
  head("index", o.classes, Activation::none);
}

template <class T>
Var<T> DenseExtractor<T>::up(const Params<T>& params, Var<T> coarse, Var<T> skip, const Block& block) const {
  const Var<T> fine = upsample_to(coarse, skip.shape()[1], skip.shape()[2], Interpolation::bilinear);
  return block(params, concatenate({fine, skip}));
}

template <class T>
typename DenseExtractor<T>::Output DenseExtractor<T>::operator()(const Params<T>& params,
                                                                 Var<T> image) const {
  check_image(image.shape());
  Var<T> x = space_to_depth(centred_image(image, 2));
  std::array<Var<T>, 4> levels{x, x, x, x};
  for (std::size_t level = 0; level < 4; ++level) {
    if (level > 0) x = avg_pool(x, 2);
    x = down_[2 * level + 1](params, down_[2 * level](params, x));
    levels[level] = x;
  }
  x = up(params, x, levels[2], up_[0]);
  x = up(params, x, levels[1], up_[1]);

  // A 1 x 1 convolution is a dense layer over the places.
  const Index height = x.shape()[1], width = x.shape()[2], places = height * width;
  const Var<T> features = x.tape().reshape(x, {places, x.shape()[3]});
  const Var<T> sign = x.tape().reshape(heads_[0](params, features), {places});
  return {.sign = sign,
          .index = heads_[2](params, heads_[1](params, features)),
          .height = height,
          .width = width};
}

template class DenseExtractor<float>;
template class DenseExtractor<double>;

}  // namespace fieldmark::extractor
