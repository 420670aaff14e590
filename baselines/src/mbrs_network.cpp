#include "mbrs_network.h"
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/ops/resample.h>
#include <fieldmark/engine/ops/slice.h>

#include <algorithm>
#include <string>

namespace fieldmark::baselines {
namespace {

constexpr int kDoublings = 4;
enum Blocks : std::size_t { of_image, of_message, of_both, first_read, last_read };

Index map_side(Index bits) {
  Index side = 1;
  while (side * side < bits) ++side;
  return side;
}

}  // namespace

template <class T>
MbrsNetwork<T>::MbrsNetwork(ParamStore<T>& store, const HidingOptions& options, std::uint64_t seed)
    : options_(options), side_(map_side(options.bits)) {
  const Index c = options.channels, map = side_ * side_;
  if (options.bits < 1 || c < 1)
    throw ValueError("[mbrs_network] bits and channels must be at least 1, got " +
                     std::to_string(options.bits) + " and " + std::to_string(c));
  blocks_.emplace_back(store, "encoder/image", 3, c, seed + 100);
  blocks_.emplace_back(store, "encoder/message", 1, c, seed + 101);
  blocks_.emplace_back(store, "encoder/both", 2 * c, c, seed + 102);
  for (int k = 0; k < kDoublings; ++k)
    doubling_.emplace_back(store, "encoder/double" + std::to_string(k), c,
                           seed + 110 + static_cast<std::uint64_t>(k));
  encoder_.emplace_back(store, "encoder/image_se", c, seed + 120);
  encoder_.emplace_back(store, "encoder/message_se", c, seed + 130);
  to_colour_ = std::make_unique<Conv2d<T>>(store, "encoder/colour",
                                           Conv2dOptions{.in = c + 3, .out = 3, .kernel = 1}, seed + 140);
  blocks_.emplace_back(store, "decoder/first", 3, c, seed + 200);
  for (int k = 0; k < kDoublings; ++k)
    decoder_.emplace_back(store, "decoder/se" + std::to_string(k), c,
                          seed + 210 + 10 * static_cast<std::uint64_t>(k));
  blocks_.emplace_back(store, "decoder/last", c, 1, seed + 260, false);
  if (map == options.bits) return;
  linear_.emplace_back(store, "encoder/map", DenseOptions{.in = options.bits, .out = map}, seed + 150);
  linear_.emplace_back(store, "decoder/map", DenseOptions{.in = map, .out = options.bits}, seed + 270);
}

template <class T>
Var<T> MbrsNetwork<T>::encode(const Params<T>& params, Var<T> images, Var<T> messages,
                              NormPass<T>& pass) const {
  check_hiding("mbrs_network", images, &messages, options_.bits);
  const Index n = images.shape()[0], h = images.shape()[1], w = images.shape()[2];
  const Var<T> shown = encoder_[0](params, blocks_[of_image](params, images, pass), pass);
  const Var<T> sent = linear_.empty() ? messages : linear_[0](params, messages);
  Var<T> map = blocks_[of_message](params, messages.tape().reshape(sent, {n, side_, side_, 1}), pass);
  for (const auto& twice : doubling_) map = twice(params, map, pass);
  map = encoder_[1](params, map, pass);
  if (map.shape()[1] != h || map.shape()[2] != w) map = upsample_to(map, h, w);
  const Var<T> both = blocks_[of_both](params, concatenate<T>({shown, map}), pass);
  return add(images, (*to_colour_)(params, concatenate<T>({both, images})));
}

template <class T>
Var<T> MbrsNetwork<T>::decode(const Params<T>& params, Var<T> images, NormPass<T>& pass) const {
  check_hiding<T>("mbrs_network", images, nullptr, options_.bits);
  if (std::min(images.shape()[1], images.shape()[2]) < Index{1} << kDoublings)
    throw ShapeError("[mbrs_network] images must have at least 16 x 16 pixels, got shape " +
                     images.shape().str());
  Var<T> x = blocks_[first_read](params, images, pass);
  for (const auto& block : decoder_) x = avg_pool(block(params, x, pass), 2);
  // Resizes to s x s places: upsamples to a multiple of s, then averages.
  const Shape s = x.shape();
  if (s[1] != side_ || s[2] != side_) {
    const Index up = (std::max(s[1], s[2]) + side_ - 1) / side_;
    x = avg_pool(upsample_to(x, up * side_, up * side_), up);
  }
  x = images.tape().reshape(blocks_[last_read](params, x, pass), {s[0], side_ * side_});
  return linear_.empty() ? x : linear_[1](params, x);
}

template class MbrsNetwork<float>;
template class MbrsNetwork<double>;

}  // namespace fieldmark::baselines
