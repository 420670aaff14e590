#include "hiding_network.h"
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/ops/rows.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/engine/shape_checks.h>

#include <algorithm>
#include <string>

namespace fieldmark::baselines {
namespace {

constexpr int kEncoderBlocks = 4, kDecoderBlocks = 7, kDiscriminatorBlocks = 3;

void check(const HidingOptions& o) {
  if (o.bits < 1 || o.channels < 1)
    throw ValueError("[hiding_network] bits and channels must be at least 1, got " + std::to_string(o.bits) +
                     " and " + std::to_string(o.channels));
}

// Blocks of one width after the first, which reads `in` channels.
template <class T>
void add_blocks(std::vector<ConvBlock<T>>& blocks, ParamStore<T>& store, const std::string& name, int count,
                Index in, Index channels, std::uint64_t seed) {
  for (int k = 0; k < count; ++k) {
    blocks.emplace_back(store, name + "/" + std::to_string(blocks.size()), in, channels,
                        seed + blocks.size());
    in = channels;
  }
}

// Repeats each message [N, L] at every pixel of its image: [N, H, W, L].
template <class T>
Var<T> at_every_pixel(Var<T> messages, Index height, Index width) {
  Tape<T>& tape = messages.tape();
  const Index n = messages.shape()[0], bits = messages.shape()[1], pixels = height * width;
  auto* rows = tape.template scratch<std::int32_t>(n * pixels);
  for (Index i = 0; i < n; ++i) std::fill_n(rows + i * pixels, pixels, static_cast<std::int32_t>(i));
  const std::span<const std::int32_t> index(rows, static_cast<std::size_t>(n * pixels));
  return tape.reshape(gather_rows(messages, index), {n, height, width, bits});
}

}  // namespace

template <class T>
void check_hiding(const char* op, Var<T> images, const Var<T>* messages, Index bits) {
  check_rank(op, "images", images.shape(), 4, "[images, height, width, 3]");
  check_extent(op, "images", images.shape(), 3, 3, "red, green, blue");
  if (!messages) return;
  check_rank(op, "messages", messages->shape(), 2, "[images, bits]");
  check_extent(op, "messages", messages->shape(), 0, images.shape()[0], "one for each image");
  check_extent(op, "messages", messages->shape(), 1, bits, "bits of the network");
}

template <class T>
HiddenNetwork<T>::HiddenNetwork(ParamStore<T>& store, const HidingOptions& options, std::uint64_t seed)
    : options_(options) {
  check(options);
  const Index c = options.channels;
  add_blocks(encoder_, store, "encoder", kEncoderBlocks, 3, c, seed + 100);
  add_blocks(encoder_, store, "encoder", 1, c + 3 + options.bits, c, seed + 100);
  to_colour_ = std::make_unique<Conv2d<T>>(store, "encoder/colour",
                                           Conv2dOptions{.in = c, .out = 3, .kernel = 1}, seed + 200);
  add_blocks(decoder_, store, "decoder", kDecoderBlocks, 3, c, seed + 300);
  add_blocks(decoder_, store, "decoder", 1, c, options.bits, seed + 300);
  linear_ = std::make_unique<Dense<T>>(store, "decoder/linear",
                                       DenseOptions{.in = options.bits, .out = options.bits}, seed + 400);
}

template <class T>
Var<T> HiddenNetwork<T>::encode(const Params<T>& params, Var<T> images, Var<T> messages,
                                NormPass<T>& pass) const {
  check_hiding("hidden_network", images, &messages, options_.bits);
  Var<T> x = images;
  for (int k = 0; k < kEncoderBlocks; ++k) x = encoder_[static_cast<std::size_t>(k)](params, x, pass);
  const Var<T> sent = at_every_pixel(messages, images.shape()[1], images.shape()[2]);
  const Var<T> joined = encoder_.back()(params, concatenate<T>({sent, x, images}), pass);
  return add(images, (*to_colour_)(params, joined));
}

template <class T>
Var<T> HiddenNetwork<T>::decode(const Params<T>& params, Var<T> images, NormPass<T>& pass) const {
  check_hiding<T>("hidden_network", images, nullptr, options_.bits);
  Var<T> x = images;
  for (const ConvBlock<T>& block : decoder_) x = block(params, x, pass);
  return (*linear_)(params, global_avg_pool(x));
}

template <class T>
Discriminator<T>::Discriminator(ParamStore<T>& store, const HidingOptions& options, std::uint64_t seed) {
  check(options);
  add_blocks(blocks_, store, "discriminator", kDiscriminatorBlocks, 3, options.channels, seed + 500);
  linear_ = std::make_unique<Dense<T>>(store, "discriminator/linear",
                                       DenseOptions{.in = options.channels, .out = 1}, seed + 600);
}

template <class T>
Var<T> Discriminator<T>::operator()(const Params<T>& params, Var<T> images, NormPass<T>& pass) const {
  check_hiding<T>("discriminator", images, nullptr, 0);
  Var<T> x = images;
  for (const ConvBlock<T>& block : blocks_) x = block(params, x, pass);
  return images.tape().reshape((*linear_)(params, global_avg_pool(x)), {images.shape()[0]});
}

template void check_hiding(const char*, Var<float>, const Var<float>*, Index);
template void check_hiding(const char*, Var<double>, const Var<double>*, Index);
template class HiddenNetwork<float>;
template class HiddenNetwork<double>;
template class Discriminator<float>;
template class Discriminator<double>;

}  // namespace fieldmark::baselines
