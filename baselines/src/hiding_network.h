#pragma once
#include <fieldmark/engine/nn/dense.h>
#include "conv_block.h"

#include <memory>
#include <string_view>

namespace fieldmark::baselines {

/// Options of a HidingNetwork.
struct HidingOptions {
  Index bits = 16;      ///< L, at least 1
  Index channels = 64;  ///< of all hidden convolutions, at least 1
  Index tile = 64;      ///< side in pixels of the tiles that an ImageMarker cuts images into, at least 16
};

/// A network that hides a message in images and reads it. Images are [N, H, W, 3] in [-1, 1], messages [N, L]
/// of 0 and 1; an output above 1/2 reads as bit 1.
template <class T>
class HidingNetwork {
 public:
  virtual ~HidingNetwork() = default;
  /// Returns the marked images, not clamped. @throws ShapeError if images and messages do not fit
  /// Differentiable in: images, messages and the parameters.
  virtual Var<T> encode(const Params<T>& params, Var<T> images, Var<T> messages, NormPass<T>& pass) const = 0;
  /// Reads messages from images. @return [N, L]   @throws ShapeError if images do not fit
  /// Differentiable in: images and the parameters.
  virtual Var<T> decode(const Params<T>& params, Var<T> images, NormPass<T>& pass) const = 0;
};

/// HiDDeN. Encoder: 4 blocks (3 x 3 convolution, batch normalisation, ReLU) of 64 channels; the message,
/// repeated at every pixel and concatenated with their output and the image; one more block; and a 1 x 1
/// convolution to the three colours, which are added to the image. Decoder: 7 blocks of 64, one to L
/// channels, the average over all pixels, one linear layer. Source: Zhu et al. 2018 (HiDDeN: hiding data with
/// deep networks), section 3.2. Departure: their last convolution outputs the marked image itself, so that
/// the network must first learn to copy it.
template <class T>
class HiddenNetwork final : public HidingNetwork<T> {
 public:
  /// Registers parameters "encoder/*" and "decoder/*". @throws ValueError if an option is out of range
  HiddenNetwork(ParamStore<T>& store, const HidingOptions& options, std::uint64_t seed);
  Var<T> encode(const Params<T>& params, Var<T> images, Var<T> messages, NormPass<T>& pass) const override;
  Var<T> decode(const Params<T>& params, Var<T> images, NormPass<T>& pass) const override;

 private:
  HidingOptions options_;
  std::vector<ConvBlock<T>> encoder_, decoder_;
  std::unique_ptr<Conv2d<T>> to_colour_;
  std::unique_ptr<Dense<T>> linear_;
};

/// Tells marked from unmarked images, as an adversary of the encoder: 3 blocks of 64 channels, the average
/// over all pixels, one linear layer.
/// Source: Zhu et al. 2018 (HiDDeN), section 3.2.
template <class T>
class Discriminator {
 public:
  /// Registers parameters "discriminator/*". @throws ValueError if an option is out of range
  Discriminator(ParamStore<T>& store, const HidingOptions& options, std::uint64_t seed);
  /// @param images [N, H, W, 3] in [-1, 1]   @return [N] logits that an image is marked
  /// Differentiable in: images and the parameters.
  Var<T> operator()(const Params<T>& params, Var<T> images, NormPass<T>& pass) const;

 private:
  std::vector<ConvBlock<T>> blocks_;
  std::unique_ptr<Dense<T>> linear_;
};

/// @throws ShapeError unless images are [N, H, W, 3] and messages, if any, [N, L]
template <class T>
void check_hiding(const char* op, Var<T> images, const Var<T>* messages, Index bits);

}  // namespace fieldmark::baselines
