#pragma once
#include <fieldmark/engine/ops/batch_norm.h>
#include <fieldmark/engine/params.h>

#include <string_view>

namespace fieldmark {

/// Batch normalisation layer with the parameters "<name>/gamma" [C], initially 1, and "<name>/beta" [C],
/// initially 0, and the running statistics "<name>/running_mean" [C], initially 0, and
/// "<name>/running_variance" [C], initially 1. The store holds the statistics too, for checkpoints, as
/// ParamRole::running: they get no gradient, and no optimiser changes them.
template <class T>
class BatchNorm {
 public:
  /// @param channels  C, at least 1   @throws ValueError if it is not, or a name is taken
  BatchNorm(ParamStore<T>& store, std::string_view name, Index channels,
            const BatchNormOptions& options = {});

  /// Normalises with the batch's own statistics, see batch_norm().
  /// @param statistics  if not null, receives them for update()
  /// Differentiable in: x and the parameters.
  Var<T> operator()(const Params<T>& params, Var<T> x, BatchStatistics* statistics = nullptr) const;
  /// Normalises with the running statistics, see batch_norm_fixed().
  Var<T> evaluate(const Params<T>& params, Var<T> x) const;
  /// Updates the statistics: running = (1 - momentum) running + momentum batch.
  /// @param momentum  in [0, 1]   @throws ValueError if it is not   @throws ShapeError unless C channels are
  /// given
  void update(ParamStore<T>& store, const BatchStatistics& batch, double momentum = 0.1) const;

 private:
  BatchNormOptions options_;
  ParamId gamma_, beta_, mean_, variance_;
};

}  // namespace fieldmark
