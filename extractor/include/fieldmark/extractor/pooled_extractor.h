#pragma once
#include <fieldmark/engine/nn/batch_norm.h>
#include <fieldmark/engine/nn/conv2d.h>
#include <fieldmark/engine/nn/dense.h>

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace fieldmark::extractor {

/// Options of a PooledExtractor.
struct PooledExtractorOptions {
  Index n_bits = 0;     ///< N_b, at least 1
  Index channels = 64;  ///< of all convolutions but the last, which has n_bits; at least 1
  Index layers = 9;     ///< number of convolutions, at least 1
};

/// CopyRNeRF's extractor H: convolutions with batch normalisation and ReLU, an average over all pixels, and
/// one linear layer.
///   logits = W mean_ij(block_9(.. block_1(2 x - 1))) + b,   block = relu(batch_norm(conv 3 x 3, stride 1))
/// W starts at 2 N_b times the identity, so that channel i gives bit i, and b so that the logits of noise
/// start at 0. Source: Luo et al. 2023 (CopyRNeRF), section 3.3; number and width of the layers as in the
/// authors' code.
template <class T>
class PooledExtractor {
 public:
  /// @throws ValueError if an option is out of range, or the names are taken in the store
  PooledExtractor(ParamStore<T>& store, std::string_view name, const PooledExtractorOptions& options,
                  std::uint64_t seed);

  /// Normalises with the statistics of the given images: in training, and for the preset `code` also at test
  /// time, one image at a time.
  /// @param images [N, H, W, 3] in [0, 1], any H and W from 1
  /// @param statistics  if not null, receives one entry per layer, for update()
  /// @return [N, N_b] logits; a bit is 1 where its logit is positive
  /// @throws ShapeError if images do not fit
  /// Differentiable in: images and the parameters; kinks of the ReLUs.
  Var<T> operator()(const Params<T>& params, Var<T> images,
                    std::vector<BatchStatistics>* statistics = nullptr) const;
  /// The network's output before the average, for losses that supervise each pixel. The mean of the pixel
  /// logits of an image is the logit of that image: the average and the linear layer commute.
  struct Places {
    Var<T> features;  ///< [N H W, C] before the last block
    Var<T> pixels;    ///< [N H W, N_b] logits
    Var<T> images;    ///< [N, N_b] logits, as operator() returns them
  };
  /// Returns the values before and after the average of operator().
  Places places(const Params<T>& params, Var<T> images,
                std::vector<BatchStatistics>* statistics = nullptr) const;
  /// As operator(), with the running statistics, so that no image depends on another.
  Var<T> evaluate(const Params<T>& params, Var<T> images) const;
  /// Returns the number of channels of all convolutions but the last.
  Index channels() const { return channels_; }
  /// Moves the running statistics towards a batch's, see BatchNorm::update().
  /// @throws ShapeError unless there is one entry per layer   @throws as BatchNorm::update()
  void update(ParamStore<T>& store, std::span<const BatchStatistics> batch, double momentum = 0.1) const;

 private:
  // The outputs of the last block and of the one before it.
  struct Blocks {
    Var<T> before, last;
  };
  template <class Norm>
  Blocks blocks(const Params<T>& params, Var<T> images, Norm norm) const;
  Blocks trained_blocks(const Params<T>& params, Var<T> images,
                        std::vector<BatchStatistics>* statistics) const;

  Index channels_;
  std::vector<Conv2d<T>> convs_;
  std::vector<BatchNorm<T>> norms_;
  std::vector<Dense<T>> linear_;  // one
};

}  // namespace fieldmark::extractor
