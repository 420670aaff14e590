#pragma once
#include <fieldmark/engine/ops/conv2d.h>
#include <fieldmark/engine/params.h>

#include <optional>
#include <string_view>

namespace fieldmark {

/// Extents, window and activation of a Conv2d layer.
struct Conv2dOptions {
  Index in = 0;                              ///< channels of the input, >= 1
  Index out = 0;                             ///< channels of the output, >= 1
  Index kernel = 3;                          ///< side of the window, >= 1; odd unless padding is given
  Activation activation = Activation::none;  ///< applied to the sums, in the same pass
  Index stride = 1;                          ///< pixels from one window to the next, >= 1
  std::optional<Index> padding = {};  ///< pixels of zeros around the image, >= 0; default (kernel - 1) / 2
  bool bias = true;                   ///< false: b is 0 and not a parameter
};

/// Convolution layer, see conv2d(). Weights start uniform in +-sqrt(6 / (kernel^2 in)) (He et al. 2015), the
/// bias at 0. The store holds the parameters "<name>/weight" [K, K, in, out] and "<name>/bias" [out].
template <class T>
class Conv2d {
 public:
  /// @throws ValueError  if an option is out of range, or the names are taken in the store
  Conv2d(ParamStore<T>& store, std::string_view name, const Conv2dOptions& options, std::uint64_t seed);

  /// @param x  [N, H, W, in]    @return  [N, H', W', out], as large as x by default, see conv2d()
  /// @throws ShapeError  if x does not fit
  /// Differentiable in: x and the parameters.
  Var<T> operator()(const Params<T>& params, Var<T> x) const;

 private:
  Conv2dOptions options_;
  ParamId weight_, bias_;
};

}  // namespace fieldmark
