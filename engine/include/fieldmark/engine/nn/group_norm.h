#pragma once
#include <fieldmark/engine/ops/group_norm.h>
#include <fieldmark/engine/params.h>

#include <string_view>

namespace fieldmark {

/// Group normalisation layer with the parameters "<name>/gamma" [C], initially 1, and "<name>/beta" [C],
/// initially 0.
template <class T>
class GroupNorm {
 public:
  /// @param channels  C, a multiple of options.groups   @throws ValueError if it is not, or a name is taken
  GroupNorm(ParamStore<T>& store, std::string_view name, Index channels,
            const GroupNormOptions& options = {});

  /// Applies group_norm().   @param x [N, H, W, C]   @return [N, H, W, C]
  /// Differentiable in: x and the parameters.
  Var<T> operator()(const Params<T>& params, Var<T> x) const;

 private:
  GroupNormOptions options_;
  ParamId gamma_, beta_;
};

}  // namespace fieldmark
