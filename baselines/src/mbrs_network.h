#pragma once
#include "doubling_conv.h"
#include "hiding_network.h"
#include "squeeze_excite.h"

namespace fieldmark::baselines {

/// MBRS. Encoder: the image through a block (convolution 3 x 3, batch normalisation, ReLU) of 64 channels
/// and a squeeze-and-excitation block; the message as a map of s x s, s = ceil(sqrt L), through a block, four
/// transposed convolutions that double it, and a squeeze-and-excitation block; both joined, a block, joined
/// with the image, a convolution 1 x 1 to the colours, added to the image. Decoder: a block, four times a
/// squeeze-and-excitation block and an average over 2 x 2 pixels, a block to one channel on a map of s x s.
/// Where L is no square, linear layers stand between message and map. Source: Jia et al. 2021 (MBRS),
/// section 3.2. Departures: one squeeze-and-excitation block where the paper has four, averages where its
/// decoder has strides, and the image need not be copied by the network. Images of other sizes than 16 s
/// have the map resampled (bilinear) on the way in, and on the way out averaged.
template <class T>
class MbrsNetwork final : public HidingNetwork<T> {
 public:
  /// Parameters are "encoder/*" and "decoder/*". @throws ValueError if an option is out of range
  MbrsNetwork(ParamStore<T>& store, const HidingOptions& options, std::uint64_t seed);
  Var<T> encode(const Params<T>& params, Var<T> images, Var<T> messages, NormPass<T>& pass) const override;
  /// @throws ShapeError also if the images are smaller than 16 pixels
  Var<T> decode(const Params<T>& params, Var<T> images, NormPass<T>& pass) const override;

 private:
  HidingOptions options_;
  Index side_;
  std::vector<ConvBlock<T>> blocks_;  // of image, message, joined; decoder's first and last
  std::vector<DoublingConv<T>> doubling_;
  std::vector<SqueezeExciteBlock<T>> encoder_, decoder_;
  std::vector<Dense<T>> linear_;  // message to map and back, where L is no square
  std::unique_ptr<Conv2d<T>> to_colour_;
};

}  // namespace fieldmark::baselines
