#pragma once
#include <fieldmark/engine/ops/dense.h>
#include <fieldmark/engine/params.h>

#include <string_view>

namespace fieldmark {

/// Extents and activation of a Dense layer.
struct DenseOptions {
  Index in = 0;                              ///< features of an input row, >= 1
  Index out = 0;                             ///< features of an output row, >= 1
  Activation activation = Activation::none;  ///< applied to the sums, in the same pass
  bool bias = true;                          ///< false: b is 0 and not a parameter
};

/// Affine layer y = act(x W + b). W starts uniform in +-sqrt(6 / in) (He et al. 2015, eq. 10, uniform form),
/// b at 0. The store holds the parameters "<name>/weight" [in, out] and "<name>/bias" [out].
template <class T>
class Dense {
 public:
  /// @throws ValueError  if in or out is below 1, or the names are taken in the store
  Dense(ParamStore<T>& store, std::string_view name, const DenseOptions& options, std::uint64_t seed);

  /// @param x  [N, in]    @return  [N, out]    @throws ShapeError  if x does not fit
  /// Differentiable in: x and the parameters.
  Var<T> operator()(const Params<T>& params, Var<T> x) const;

 private:
  DenseOptions options_;
  ParamId weight_, bias_;
};

}  // namespace fieldmark
