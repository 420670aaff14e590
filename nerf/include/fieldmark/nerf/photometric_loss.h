#pragma once
#include <fieldmark/engine/tape.h>

#include <span>
#include <type_traits>

namespace fieldmark::nerf {

/// Shape of photometric_loss().
struct PhotometricLossOptions {
  double huber = 0.1;  ///< residual at which the square becomes linear, > 0; infinity for the plain square
  double scale = 1;    ///< multiplies the loss
};

/// Returns the residual e of photometric_loss() in channel k of one ray.
/// @param ray  composited rgba   @param truth  straight rgba   @param background  rgb
template <class T>
T photometric_residual(const T* ray, const T* truth, const T* background, Index k) {
  return ray[k] - truth[3] * truth[k] + (truth[3] - ray[3]) * background[k];
}

/// Computes the Huber loss of composited rays against ground truth, both over the same background.
///   e = (C + (1 - A) b) - (alpha p + (1 - alpha) b),   L = scale / (3 R) sum h(e),   h(e) = e^2 / 2 within
///   huber, linear beyond
/// A random background for every ray lets the loss see opacity where the ground truth has an alpha channel.
/// @param rays        [R, 4] colour and opacity, see composite()
/// @param truth       [R, 4] straight colour and alpha in [0, 1]
/// @param background  [R, 3]; both spans must outlive the pass
/// @return [1]   @throws ShapeError if sizes do not match   @throws ValueError if huber is not positive
/// Differentiable in: rays. Kinks of the second derivative at |e| = huber.
template <class T>
Var<T> photometric_loss(Var<T> rays, std::span<const std::type_identity_t<T>> truth,
                        std::span<const std::type_identity_t<T>> background,
                        const PhotometricLossOptions& options = {});

}  // namespace fieldmark::nerf
