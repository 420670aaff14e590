#pragma once
#include <fieldmark/engine/tape.h>

#include <span>

namespace fieldmark::nerf {

/// Form of photometric_loss().
struct PhotometricLossOptions {
  double huber = 0.1;  ///< residual at which the square becomes linear, > 0; infinity for the plain square
  double scale = 1;    ///< multiplies the loss
};

/// Distance of composited rays from photographs, both over the same background.
///   e = (C + (1 - A) b) - (alpha p + (1 - alpha) b),   L = scale / (3 R) sum h(e),   h(e) = e^2 / 2 within
///   huber, linear beyond
/// A background drawn anew for every ray makes opacity itself visible to the loss, where photographs have an
/// alpha channel.
/// @param rays        [R, 4] colour and opacity, see composite()
/// @param photograph  [R, 4] straight colour and alpha in [0, 1]   @param background  [R, 3]; both must
/// outlive the pass
/// @return [1]   @throws ShapeError if sizes do not fit   @throws ValueError if huber is not positive
/// Differentiable in: rays. Kinks of the second derivative at |e| = huber.
template <class T>
Var<T> photometric_loss(Var<T> rays, std::span<const T> photograph, std::span<const T> background,
                        const PhotometricLossOptions& options = {});

}  // namespace fieldmark::nerf
