#pragma once
#include "doubling_conv.h"
#include "hiding_network.h"
#include "squeeze_excite.h"

namespace fieldmark::baselines {

/// MBRS. Encoder: the image passes a block (3 x 3 convolution, batch normalisation, ReLU) of 64 channels and
/// a squeeze-and-excitation block. The message, as a map of s x s with s = ceil(sqrt L), passes a block, four
/// transposed convolutions that double its size, and a squeeze-and-excitation block. Both are concatenated
/// and pass a block; the result is concatenated with the image, and a 1 x 1 convolution gives the colours
/// added to the image. Decoder: a block, four times a squeeze-and-excitation block and an average over 2 x 2
/// pixels, and a block to one channel on a map of s x s. If L is not a square, linear layers convert between
/// message and map. Source: Jia et al. 2021 (MBRS), section 3.2. Departures: one squeeze-and-excitation block
/// where the paper has four, averages instead of strides in the decoder, and the network need not copy the
/// image. For images of sizes other than 16 s, the encoder resamples the map (bilinear) and the decoder
/// averages it.
template <class T>
class MbrsNetwork final : public HidingNetwork<T> {
 public:
  /// Registers parameters "encoder/*" and "decoder/*". @throws ValueError if an option is out of range
  MbrsNetwork(ParamStore<T>& store, const HidingOptions& options, std::uint64_t seed);
  Var<T> encode(const Params<T>& params, Var<T> images, Var<T> messages, NormPass<T>& pass) const override;
  /// @throws ShapeError also if the images are smaller than 16 pixels
  Var<T> decode(const Params<T>& params, Var<T> images, NormPass<T>& pass) const override;

 private:
  HidingOptions options_;
  Index side_;
  std::vector<ConvBlock<T>> blocks_;  // of image, message, both; decoder's first and last
  std::vector<DoublingConv<T>> doubling_;
  std::vector<SqueezeExciteBlock<T>> encoder_, decoder_;
  std::vector<Dense<T>> linear_;  // message to map and back, if L is not a square
  std::unique_ptr<Conv2d<T>> to_colour_;
};

}  // namespace fieldmark::baselines
