#pragma once
#include <fieldmark/engine/nn/dense.h>
#include "conv_block.h"

namespace fieldmark::baselines {

/// Scales each channel of each image.   y[n, i, j, c] = x[n, i, j, c] s[n, c]
/// @param x [N, H, W, C]   @param s [N, C]   @return [N, H, W, C]   @throws ShapeError if they do not fit
/// Differentiable in: x, s.
template <class T>
Var<T> scale_channels(Var<T> x, Var<T> s);

/// A residual block that weights its channels by the content of the whole image:
///   y = relu(x + s(b) b),   b = block_1(block_0(x)),   s(b) = sigmoid(W1 relu(W0 mean_ij b))
/// with two 3 x 3 convolutions, each with batch normalisation, and an eighth of the channels between W0 and
/// W1. Source: Hu et al. 2018 (squeeze-and-excitation networks), section 3; as in Jia et al. 2021 (MBRS).
template <class T>
class SqueezeExciteBlock {
 public:
  /// @throws ValueError if channels is below 1 or a name is taken
  SqueezeExciteBlock(ParamStore<T>& store, std::string_view name, Index channels, std::uint64_t seed);
  /// @param x [N, H, W, channels]   @return the same shape   Differentiable in: x and the parameters.
  Var<T> operator()(const Params<T>& params, Var<T> x, NormPass<T>& pass) const;

 private:
  ConvBlock<T> first_, second_;
  Dense<T> squeeze_, excite_;
};

}  // namespace fieldmark::baselines
