#pragma once
#include <fieldmark/engine/nn/dense.h>
#include "conv_block.h"

#include <memory>
#include <string_view>

namespace fieldmark::baselines {

/// Sizes of a HidingNetwork.
struct HidingOptions {
  Index bits = 16;      ///< L, at least 1
  Index channels = 64;  ///< of all hidden convolutions, at least 1
  Index tile = 64;      ///< pixels of the squares that a ImageMarker cuts images into, at least 16
};

/// A network that hides a message in images and reads it. Images are [N, H, W, 3] in [-1, 1], messages
/// [N, L] of 0 and 1; a bit is read as 1 where its number exceeds 1/2.
template <class T>
class HidingNetwork {
 public:
  virtual ~HidingNetwork() = default;
  /// The marked images, not clamped. @throws ShapeError if images and messages do not fit
  /// Differentiable in: images, messages and the parameters.
  virtual Var<T> encode(const Params<T>& params, Var<T> images, Var<T> messages, NormPass<T>& pass) const = 0;
  /// What is read from images. @return [N, L]   @throws ShapeError if images do not fit
  /// Differentiable in: images and the parameters.
  virtual Var<T> decode(const Params<T>& params, Var<T> images, NormPass<T>& pass) const = 0;
};

/// HiDDeN. Encoder: 4 blocks (convolution 3 x 3, batch normalisation, ReLU) of 64 channels, the message
/// repeated for every pixel and joined with their output and the image, one more block, and a convolution
/// 1 x 1 to the three colours, which are added to the image. Decoder: 7 blocks of 64, one to L channels,
/// the average over all pixels, one linear layer. Source: Zhu et al. 2018 (HiDDeN: hiding data with deep
/// networks), section 3.2. Departure: their last convolution gives the marked image itself, which the
/// network then has to learn to copy first.
template <class T>
class HiddenNetwork final : public HidingNetwork<T> {
 public:
  /// Parameters are "encoder/*" and "decoder/*". @throws ValueError if an option is out of range
  HiddenNetwork(ParamStore<T>& store, const HidingOptions& options, std::uint64_t seed);
  Var<T> encode(const Params<T>& params, Var<T> images, Var<T> messages, NormPass<T>& pass) const override;
  Var<T> decode(const Params<T>& params, Var<T> images, NormPass<T>& pass) const override;

 private:
  HidingOptions options_;
  std::vector<ConvBlock<T>> encoder_, decoder_;
  std::unique_ptr<Conv2d<T>> to_colour_;
  std::unique_ptr<Dense<T>> linear_;
};

/// Tells marked images from those that are not, as an adversary of the encoder: 3 blocks of 64 channels,
/// the average over all pixels, one linear layer.
/// Source: Zhu et al. 2018 (HiDDeN), section 3.2.
template <class T>
class Discriminator {
 public:
  /// Parameters are "discriminator/*". @throws ValueError if an option is out of range
  Discriminator(ParamStore<T>& store, const HidingOptions& options, std::uint64_t seed);
  /// @param images [N, H, W, 3] in [-1, 1]   @return [N] logits that an image is marked
  /// Differentiable in: images and the parameters.
  Var<T> operator()(const Params<T>& params, Var<T> images, NormPass<T>& pass) const;

 private:
  std::vector<ConvBlock<T>> blocks_;
  std::unique_ptr<Dense<T>> linear_;
};

/// @throws ShapeError unless images are [N, H, W, 3] and, where there are messages, they [N, L]
template <class T>
void check_hiding(const char* op, Var<T> images, const Var<T>* messages, Index bits);

}  // namespace fieldmark::baselines
