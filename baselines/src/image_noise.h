#pragma once
#include <fieldmark/engine/random.h>
#include <fieldmark/engine/tape.h>

#include <span>

namespace fieldmark::baselines {

/// What a batch of marked images goes through before it is read in training.
enum class NoiseLayer {
  identity,        ///< nothing
  dropout,         ///< a share of 0 to 30% of the pixels is the unmarked image's
  cropout,         ///< all but a window of 30 to 100% of the area is the unmarked image's
  blur,            ///< Gaussian of 7 x 7 pixels, deviation 0.2 to 1.2, grey around
  simulated_jpeg,  ///< simulated_jpeg()
  real_jpeg        ///< a JPEG file of quality 50 and back: no gradient, so the reader alone learns from it
};

/// The layers of the two networks, identity among them: of HiDDeN all but real_jpeg, of MBRS both JPEGs.
std::span<const NoiseLayer> hidden_noise_layers();
/// As hidden_noise_layers().
std::span<const NoiseLayer> mbrs_noise_layers();

/// One layer over a batch.
/// @param marked, plain  [N, H, W, 3] in about [-1, 1], H and W multiples of 8
/// @param rng, step  where the layer's numbers come from: one set for the batch   @return as marked
/// @throws ShapeError if the shapes differ or are no images
/// Differentiable in: marked, but for real_jpeg.
template <class T>
Var<T> apply_noise_layer(NoiseLayer layer, Var<T> marked, Var<T> plain, const CounterRng& rng,
                         std::uint64_t step);

}  // namespace fieldmark::baselines
