#pragma once
#include <fieldmark/engine/random.h>
#include <fieldmark/engine/tape.h>

#include <span>

namespace fieldmark::baselines {

/// Noise that a batch of marked images passes in training before it is read.
enum class NoiseLayer {
  identity,        ///< no change
  dropout,         ///< replaces 0 to 30% of the pixels by the unmarked image's
  cropout,         ///< replaces all but a window of 30 to 100% of the area by the unmarked image
  blur,            ///< Gaussian of 7 x 7 pixels, deviation 0.2 to 1.2, grey padding
  simulated_jpeg,  ///< simulated_jpeg()
  real_jpeg        ///< JPEG round trip of quality 50: no gradient, so only the reader learns from it
};

/// Returns the layers of each network, including identity: for HiDDeN all but real_jpeg, for MBRS both JPEGs.
std::span<const NoiseLayer> hidden_noise_layers();
/// As hidden_noise_layers().
std::span<const NoiseLayer> mbrs_noise_layers();

/// Applies a layer to a batch.
/// @param marked, plain  [N, H, W, 3] in about [-1, 1], H and W multiples of 8
/// @param rng, step  source of the layer's random numbers, one set per batch   @return as marked
/// @throws ShapeError if the shapes differ or are not images
/// Differentiable in: marked, except for real_jpeg.
template <class T>
Var<T> apply_noise_layer(NoiseLayer layer, Var<T> marked, Var<T> plain, const CounterRng& rng,
                         std::uint64_t step);

}  // namespace fieldmark::baselines
