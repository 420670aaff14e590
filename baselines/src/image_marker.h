#pragma once
#include <fieldmark/engine/tensor.h>
#include <fieldmark/watermark/payload/message.h>
#include "hiding_network.h"

#include <filesystem>
#include <memory>

namespace fieldmark::baselines {

/// The 2-D networks that there are.
enum class HidingKind {
  hidden,  ///< HiddenNetwork
  mbrs     ///< MbrsNetwork
};
/// "hidden" or "mbrs".
const char* hiding_name(HidingKind kind);

/// A 2-D network with its numbers: marks images and reads them, in tiles of the size that it was trained
/// on, each with the whole message. What its whole tiles say is averaged, of those that show something if any
/// does.
class ImageMarker {
 public:
  /// With initial numbers. @throws ValueError if an option is out of range
  ImageMarker(HidingKind kind, const HidingOptions& options, std::uint64_t seed);

  /// The image with a message, rounded to 8 bits, by the running statistics.
  /// @param image  [H, W, 3] in [0, 1]
  /// @param strength  PSNR of the result, dB: the residual is scaled until the rounded image has it, to
  ///                  0.01 dB where black and white let it; 0: as the network has it
  /// @throws ShapeError if the image is not one   @throws ValueError if the message has another length
  Tensor<float> mark(const Tensor<float>& image, const watermark::Message& message,
                     double mark_psnr = 0) const;
  /// What is read from an image [H, W, 3] in [0, 1]. @throws ShapeError if it is not one
  watermark::Message read(const Tensor<float>& image) const;
  /// Share of the bits of `sent` that are read right.
  double accuracy(const Tensor<float>& image, const watermark::Message& sent) const;

  /// The options given to the constructor.
  HidingKind kind() const { return kind_; }
  /// The options given to the constructor.
  const HidingOptions& options() const { return options_; }
  /// The network, to be trained.
  const HidingNetwork<float>& network() const { return *network_; }

  ParamStore<float> params;  ///< encoder and decoder, with their running statistics

 private:
  HidingKind kind_;
  HidingOptions options_;
  std::unique_ptr<HidingNetwork<float>> network_;
};

}  // namespace fieldmark::baselines
