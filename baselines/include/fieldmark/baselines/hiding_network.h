#pragma once
#include <fieldmark/baselines/conv_block.h>
#include <fieldmark/engine/nn/dense.h>

#include <memory>
#include <string_view>

namespace fieldmark::baselines {

/// Sizes of a HidingNetwork.
struct HidingOptions {
  Index bits = 16;      ///< L, at least 1
  Index channels = 64;  ///< of all hidden convolutions, at least 1
  Index tile = 64;      ///< pixels of the squares that a PictureMarker cuts pictures into, at least 16
};

/// A network that hides a message in pictures and reads it. Pictures are [N, H, W, 3] in [-1, 1], messages
/// [N, L] of 0 and 1; a bit is read as 1 where its number exceeds 1/2.
template <class T>
class HidingNetwork {
 public:
  virtual ~HidingNetwork() = default;
  /// The marked pictures, not clamped. @throws ShapeError if pictures and messages do not fit
  /// Differentiable in: pictures, messages and the parameters.
  virtual Var<T> encode(const Params<T>& params, Var<T> pictures, Var<T> messages,
                        NormPass<T>& pass) const = 0;
  /// What is read from pictures. @return [N, L]   @throws ShapeError if pictures do not fit
  /// Differentiable in: pictures and the parameters.
  virtual Var<T> decode(const Params<T>& params, Var<T> pictures, NormPass<T>& pass) const = 0;
};

/// HiDDeN. Encoder: 4 blocks (convolution 3 x 3, batch normalisation, ReLU) of 64 channels, the message
/// repeated for every pixel and joined with their output and the picture, one more block, and a convolution
/// 1 x 1 to the three colours, which are added to the picture. Decoder: 7 blocks of 64, one to L channels,
/// the average over all pixels, one linear layer. Source: Zhu et al. 2018 (HiDDeN: hiding data with deep
/// networks), section 3.2. Departure: their last convolution gives the marked picture itself, which the
/// network then has to learn to copy first.
template <class T>
class HiddenNetwork final : public HidingNetwork<T> {
 public:
  /// Parameters are "encoder/*" and "decoder/*". @throws ValueError if an option is out of range
  HiddenNetwork(ParamStore<T>& store, const HidingOptions& options, std::uint64_t seed);
  Var<T> encode(const Params<T>& params, Var<T> pictures, Var<T> messages, NormPass<T>& pass) const override;
  Var<T> decode(const Params<T>& params, Var<T> pictures, NormPass<T>& pass) const override;

 private:
  HidingOptions options_;
  std::vector<ConvBlock<T>> encoder_, decoder_;
  std::unique_ptr<Conv2d<T>> to_colour_;
  std::unique_ptr<Dense<T>> linear_;
};

/// Tells marked pictures from those that are not, as an adversary of the encoder: 3 blocks of 64 channels,
/// the average over all pixels, one linear layer.
/// Source: Zhu et al. 2018 (HiDDeN), section 3.2.
template <class T>
class Discriminator {
 public:
  /// Parameters are "discriminator/*". @throws ValueError if an option is out of range
  Discriminator(ParamStore<T>& store, const HidingOptions& options, std::uint64_t seed);
  /// @param pictures [N, H, W, 3] in [-1, 1]   @return [N] logits that a picture is marked
  /// Differentiable in: pictures and the parameters.
  Var<T> operator()(const Params<T>& params, Var<T> pictures, NormPass<T>& pass) const;

 private:
  std::vector<ConvBlock<T>> blocks_;
  std::unique_ptr<Dense<T>> linear_;
};

/// @throws ShapeError unless pictures are [N, H, W, 3] and, where there are messages, they [N, L]
template <class T>
void check_hiding(const char* op, Var<T> pictures, const Var<T>* messages, Index bits);

}  // namespace fieldmark::baselines
