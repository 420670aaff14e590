#pragma once
#include <fieldmark/engine/tensor.h>
#include <fieldmark/watermark/payload/message.h>
#include "hiding_network.h"

#include <filesystem>
#include <memory>

namespace fieldmark::baselines {

/// The available 2-D networks.
enum class HidingKind {
  hidden,  ///< HiddenNetwork
  mbrs     ///< MbrsNetwork
};
/// Returns "hidden" or "mbrs".
const char* hiding_name(HidingKind kind);

/// A 2-D network with its weights. It marks and reads images in tiles of the size that it was trained on,
/// each with the whole message. Reading averages the output over the whole tiles, without plain ones if any
/// other exists.
class ImageMarker {
 public:
  /// Initialises the weights. @throws ValueError if an option is out of range
  ImageMarker(HidingKind kind, const HidingOptions& options, std::uint64_t seed);

  /// Returns the image marked with a message, rounded to 8 bits; normalises with the running statistics.
  /// @param image  [H, W, 3] in [0, 1]
  /// @param strength  PSNR of the result, dB: the residual is scaled until the rounded image has it, to
  ///                   0.01 dB unless clamping at black and white prevents it; 0: unscaled
  /// @throws ShapeError if the image is not one   @throws ValueError if the message has another length
  Tensor<float> mark(const Tensor<float>& image, const watermark::Message& message,
                     double mark_psnr = 0) const;
  /// Reads the message of an image [H, W, 3] in [0, 1]. @throws ShapeError if it is not one
  watermark::Message read(const Tensor<float>& image) const;
  /// Returns the fraction of the bits of `sent` read correctly.
  double accuracy(const Tensor<float>& image, const watermark::Message& sent) const;

  /// Returns the kind given to the constructor.
  HidingKind kind() const { return kind_; }
  /// Returns the options given to the constructor.
  const HidingOptions& options() const { return options_; }
  /// Returns the network for training.
  const HidingNetwork<float>& network() const { return *network_; }

  ParamStore<float> params;  ///< encoder and decoder, with their running statistics

 private:
  HidingKind kind_;
  HidingOptions options_;
  std::unique_ptr<HidingNetwork<float>> network_;
};

}  // namespace fieldmark::baselines
