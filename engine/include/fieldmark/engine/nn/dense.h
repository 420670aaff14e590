#pragma once
#include <fieldmark/engine/ops/dense.h>
#include <fieldmark/engine/params.h>

#include <span>
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
  /// Applies the layer to N rows. The parts are the columns of x, from left to right.
  ///   y = act(x_N W_N + (x_R W_R + b))
  /// x_N are the parts with N rows. x_R are those with R < N rows, such as the message of an image beside the
  /// samples of its pixels: the layer multiplies each row once, and row r counts for rows r N / R to
  /// (r + 1) N / R - 1. Beside such parts, weights are not read as bf16.
  /// @param parts  [N, .] or [R, .]; R divides N   @param rows  N   @return  [N, out]
  /// @throws ShapeError  if the parts do not fit each other, `rows` or `in`
  /// Differentiable in: the parts and the parameters.
  Var<T> operator()(const Params<T>& params, std::span<const Var<T>> parts, Index rows) const;

 private:
  DenseOptions options_;
  ParamId weight_, bias_;
};

}  // namespace fieldmark
