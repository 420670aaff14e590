#pragma once
#include <fieldmark/engine/ops/layer_norm.h>
#include <fieldmark/engine/params.h>

#include <string_view>

namespace fieldmark {

/// Layer normalisation layer with the parameters "<name>/gamma" [C], initially 1, and "<name>/beta" [C],
/// initially 0.
template <class T>
class LayerNorm {
 public:
  /// @param channels  C, >= 1   @param eps  > 0, see layer_norm()
  /// @throws ValueError if one is out of range, or a name is taken
  LayerNorm(ParamStore<T>& store, std::string_view name, Index channels, double eps = 1e-5);

  /// Applies layer_norm().   @param x [.., C]   @return [.., C]   @throws ShapeError if x does not fit
  /// Differentiable in: x and the parameters.
  Var<T> operator()(const Params<T>& params, Var<T> x) const;

 private:
  double eps_;
  ParamId gamma_, beta_;
};

}  // namespace fieldmark
