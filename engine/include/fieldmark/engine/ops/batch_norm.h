#pragma once
#include <fieldmark/engine/tape.h>

#include <span>
#include <type_traits>
#include <vector>

namespace fieldmark {

/// Settings of batch_norm() and batch_norm_fixed().
struct BatchNormOptions {
  double eps = 1e-5;  ///< added to the variance, > 0
  bool relu = false;  ///< applies max(y, 0) in the same pass over memory
};

/// Statistics of a batch, one value per channel.
struct BatchStatistics {
  std::vector<double> mean;      ///< over images, height and width
  std::vector<double> variance;  ///< E[(x - mean)^2], divided by the count
};

/// Applies batch normalisation with the batch's own statistics over images, height and width.
///   y = gamma (x - mean) / sqrt(var + eps) + beta
/// Source: Ioffe and Szegedy 2015, algorithm 1. A constant channel, or a batch of one pixel, gives beta
/// exactly.
/// @param x [N, H, W, C]   @param gamma [C]   @param beta [C]
/// @param statistics  if not null, receives the statistics (for running averages)
/// @return [N, H, W, C]
/// @throws ShapeError if the shapes do not fit   @throws ValueError if eps is not above 0
/// Differentiable in: x (also through the statistics), gamma, beta; with relu, except where y = 0.
template <class T>
Var<T> batch_norm(Var<T> x, Var<T> gamma, Var<T> beta, const BatchNormOptions& options = {},
                  BatchStatistics* statistics = nullptr);

/// Like batch_norm(), but with given statistics, for evaluating a trained network.
/// @param mean, variance  [C], copied   @throws as batch_norm; ValueError if a variance is negative
/// Differentiable in: x, gamma, beta; with relu, except where y = 0.
template <class T>
Var<T> batch_norm_fixed(Var<T> x, Var<T> gamma, Var<T> beta, std::span<const std::type_identity_t<T>> mean,
                        std::span<const std::type_identity_t<T>> variance,
                        const BatchNormOptions& options = {});

}  // namespace fieldmark
