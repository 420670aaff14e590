#pragma once
#include <fieldmark/engine/nn/dense.h>
#include "conv_block.h"

namespace fieldmark::baselines {

/// Rearranges channels into blocks of 2 x 2 pixels, the inverse of space_to_depth().
///   y[n, 2 i + a, 2 j + b, c] = x[n, i, j, (2 a + b) C + c]
/// @param x [N, H, W, 4 C]   @return [N, 2 H, 2 W, C]   @throws ShapeError if x is not
/// Differentiable in: x.
template <class T>
Var<T> depth_to_space(Var<T> x);

/// 2 x 2 transposed convolution with stride 2, batch normalisation and ReLU: doubles the size of an image.
/// Since the stride equals the window, windows do not overlap, so it is a linear layer from each pixel to 2 x
/// 2 pixels.
template <class T>
class DoublingConv {
 public:
  /// @throws ValueError if channels is below 1 or a name is taken
  DoublingConv(ParamStore<T>& store, std::string_view name, Index channels, std::uint64_t seed);
  /// @param x [N, H, W, channels]   @return [N, 2 H, 2 W, channels]
  /// Differentiable in: x and the parameters.
  Var<T> operator()(const Params<T>& params, Var<T> x, NormPass<T>& pass) const;

 private:
  Index channels_;
  Dense<T> spread_;
  BatchNorm<T> norm_;
};

}  // namespace fieldmark::baselines
