#include "crop_source.h"
#include <fieldmark/engine/shape_checks.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace fieldmark::baselines {
namespace {

constexpr Index kOctaves = 4;
constexpr std::uint64_t kTries = 8;
constexpr double kLeastDeviation = 0.03;  // of a window that shows something

// Smooth noise with `cells` cells per side at (u, v) in [0, 1): random numbers, bilinear with easing.
float value_noise(const CounterRng& rng, std::uint64_t index, Index octave, Index cells, float u, float v) {
  const float x = u * static_cast<float>(cells), y = v * static_cast<float>(cells);
  const auto i = static_cast<Index>(x), j = static_cast<Index>(y);
  const auto ease = [](float t) { return t * t * (3 - 2 * t); };
  const float s = ease(x - static_cast<float>(i)), t = ease(y - static_cast<float>(j));
  const auto at = [&](Index a, Index b) {
    return rng.uniform(index, static_cast<std::uint64_t>((octave + 1) * 10000 + b * 100 + a));
  };
  return (1 - t) * ((1 - s) * at(i, j) + s * at(i + 1, j)) +
         t * ((1 - s) * at(i, j + 1) + s * at(i + 1, j + 1));
}

}  // namespace

bool shows_something(const Tensor<float>& image) {
  double sum = 0, squares = 0;
  for (const float v : image.data) {
    sum += static_cast<double>(v);
    squares += static_cast<double>(v) * static_cast<double>(v);
  }
  const double n = static_cast<double>(image.size()), mean = sum / n;
  return squares / n - mean * mean > kLeastDeviation * kLeastDeviation;
}

Tensor<float> window_of(const Tensor<float>& image, Index top, Index left, const Shape& shape) {
  const Index h = image.shape[0], w = image.shape[1];
  Tensor<float> window(shape);
  for (Index y = 0; y < shape[0]; ++y)
    for (Index x = 0; x < shape[1]; ++x) {
      const Index row = std::min(top + y, h - 1), column = std::min(left + x, w - 1);
      std::copy_n(image.data.begin() + (row * w + column) * 3, 3,
                  window.data.begin() + (y * shape[1] + x) * 3);
    }
  return window;
}

Tensor<float> generated_texture(Index size, const CounterRng& rng, std::uint64_t index) {
  if (size < 1) throw ValueError("[generated_texture] size must be at least 1, got " + std::to_string(size));
  const auto dark = rng.uniform4(index, 0), light = rng.uniform4(index, 1), shape = rng.uniform4(index, 2);
  const Index first = 2 + static_cast<Index>(shape[0] * 5);
  Tensor<float> image({size, size, 3});
  for (Index y = 0; y < size; ++y)
    for (Index x = 0; x < size; ++x) {
      const float u = (static_cast<float>(x) + 0.5f) / static_cast<float>(size),
                  v = (static_cast<float>(y) + 0.5f) / static_cast<float>(size);
      float mix = 0, weight = 0, amplitude = 1;
      for (Index k = 0; k < kOctaves; ++k, amplitude *= 0.35f + 0.6f * shape[1]) {
        mix += amplitude * value_noise(rng, index, k, first << k, u, v);
        weight += amplitude;
      }
      mix = std::clamp(1.6f * (mix / weight - 0.5f) + 0.5f + 0.6f * (shape[2] - 0.5f) * (u - v), 0.f, 1.f);
      for (Index c = 0; c < 3; ++c) {
        const auto channel = static_cast<std::size_t>(c);
        image[(y * size + x) * 3 + c] = dark[channel] + mix * (light[channel] - dark[channel]);
      }
    }
  return image;
}

CropSource::CropSource(std::vector<Tensor<float>> images, std::uint64_t seed)
    : images_(std::move(images)), rng_(seed, 71) {
  for (const auto& image : images_) {
    check_rank("crop_source", "images", image.shape, 3, "[height, width, 3]");
    check_extent("crop_source", "images", image.shape, 2, 3, "red, green, blue");
  }
}

Tensor<float> CropSource::crop(Index size, std::uint64_t index) const {
  if (images_.empty()) throw ValueError("[crop_source] images must not be empty");
  Tensor<float> window;
  for (std::uint64_t attempt = 0; attempt < kTries; ++attempt) {
    const auto which = rng_.below(static_cast<Index>(images_.size()), index, 3 * attempt + 100);
    const Tensor<float>& from = images_[static_cast<std::size_t>(which)];
    const Index h = from.shape[0], w = from.shape[1];
    const Index top = rng_.below(std::max<Index>(h - size, 0) + 1, index, 3 * attempt + 101);
    const Index left = rng_.below(std::max<Index>(w - size, 0) + 1, index, 3 * attempt + 102);
    window = window_of(from, top, left, {size, size, 3});
    if (shows_something(window)) break;
  }
  return window;
}

Tensor<float> CropSource::image(Index size, std::uint64_t index) const {
  if (images_.empty() || rng_.uniform(index, 99) < 0.5f) return generated_texture(size, rng_, index);
  return crop(size, index);
}

}  // namespace fieldmark::baselines
