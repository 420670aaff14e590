#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark {

/// Settings of group_norm().
struct GroupNormOptions {
  Index groups = 8;   ///< divides the channels
  double eps = 1e-5;  ///< added to the variance, > 0
  bool relu = false;  ///< applies max(y, 0) in the same pass over memory
};

/// Applies group normalisation, with the mean and variance of each image's groups of neighbouring channels
/// over height and width.
///   y = gamma (x - mean) / sqrt(var + eps) + beta,   var = E[(x - mean)^2]
/// Source: Wu and He 2018, eq. 7. Images are independent, so training and test agree.
/// A constant image, or a group of one element, gives beta exactly; statistics are kept in double.
/// @param x [N, H, W, C]   @param gamma [C]   @param beta [C]   @return [N, H, W, C]
/// @throws ShapeError if the shapes do not fit
/// @throws ValueError if groups does not divide C or eps is not above 0
/// Differentiable in: x, gamma, beta; with relu, except where y = 0.
template <class T>
Var<T> group_norm(Var<T> x, Var<T> gamma, Var<T> beta, const GroupNormOptions& options = {});

}  // namespace fieldmark
