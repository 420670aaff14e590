#pragma once
// An image with the detail that JPEG compresses.
#include <fieldmark/engine/random.h>
#include <fieldmark/imaging/image.h>

#include <cmath>

namespace fieldmark {

constexpr Index kJpegViewHeight = 104, kJpegViewWidth = 136;

// Returns waves, edges and fine grain; the amplitude of the grain sets the amount of detail.
inline Tensor<float> view_image(float grain, std::uint64_t seed) {
  const CounterRng rng(seed, 1);
  Tensor<float> x({kJpegViewHeight, kJpegViewWidth, 3});
  for (Index p = 0; p < kJpegViewHeight * kJpegViewWidth; ++p) {
    const auto u = static_cast<float>(p % kJpegViewWidth), v = static_cast<float>(p / kJpegViewWidth);
    const float edge = std::fmod(u + 2 * v, 37.f) < 18 ? 0.12f : -0.12f;
    const auto noise = rng.normal2(static_cast<std::uint64_t>(p));
    for (Index c = 0; c < 3; ++c)
      x[3 * p + c] = 0.5f + edge + 0.1f * std::sin(0.21f * u + static_cast<float>(c)) +
                     grain * noise[static_cast<std::size_t>(c % 2)];
  }
  return quantize8(x);
}

}  // namespace fieldmark
