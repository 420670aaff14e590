#pragma once
#include <fieldmark/engine/nn/batch_norm.h>
#include <fieldmark/engine/nn/conv2d.h>

#include <utility>
#include <vector>

namespace fieldmark::baselines {

/// Mode of batch normalisation in one pass through a network, and the statistics of that pass.
template <class T>
struct NormPass {
  /// True: normalises with the running statistics, so that no image depends on another; false: the batch's.
  bool running = false;
  /// The statistics of each normalisation, in order of evaluation, for update_statistics().
  std::vector<std::pair<const BatchNorm<T>*, BatchStatistics>> seen = {};
};

/// Moves the running statistics of all normalisations in a pass towards those of the batch.
/// @param momentum  see BatchNorm::update()
template <class T>
void update_statistics(ParamStore<T>& store, const NormPass<T>& pass, double momentum = 0.1);

/// 3 x 3 convolution, batch normalisation and ReLU; "<name>/conv" and "<name>/norm" in the store.
template <class T>
class ConvBlock {
 public:
  /// @param relu  false: the block ends after the normalisation
  /// @throws ValueError if an extent is below 1 or a name is taken
  ConvBlock(ParamStore<T>& store, std::string_view name, Index in, Index out, std::uint64_t seed,
            bool relu = true);
  /// @param x [N, H, W, in]   @return [N, H, W, out]   Differentiable in: x and the parameters.
  Var<T> operator()(const Params<T>& params, Var<T> x, NormPass<T>& pass) const;

 private:
  Conv2d<T> conv_;
  BatchNorm<T> norm_;
};

}  // namespace fieldmark::baselines
