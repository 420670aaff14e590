#pragma once
#include <fieldmark/engine/random.h>
#include <fieldmark/engine/tensor.h>

#include <vector>

namespace fieldmark::baselines {

/// True if an image in [0, 1] is not a plain background: its values' standard deviation exceeds 0.03.
bool shows_something(const Tensor<float>& image);

/// Returns the part of an image [H, W, 3] that begins at row `top` and column `left`, both inside it; edge
/// pixels extend outwards.   @param shape  of the part, [h, w, 3]
Tensor<float> window_of(const Tensor<float>& image, Index top, Index left, const Shape& shape);

/// Generates an image without a scene: several octaves of smooth noise between random colours over a ramp.
/// @param index  selects the image   @return [size, size, 3] in [0, 1]   @throws ValueError if size < 1
Tensor<float> generated_texture(Index size, const CounterRng& rng, std::uint64_t index);

/// Training images for 2-D networks: half of them random windows of images, half generated textures.
class CropSource {
 public:
  /// @param images  [H, W, 3] in [0, 1] of any sizes; empty: textures only
  /// @throws ShapeError if one has another shape
  CropSource(std::vector<Tensor<float>> images, std::uint64_t seed);
  /// Draws a random window of an image, or a texture. Images smaller than `size` are extended by their edge
  /// pixels. A window that shows hardly anything is redrawn up to 8 times.
  /// @param index  selects the draw   @return [size, size, 3] in [0, 1]
  Tensor<float> image(Index size, std::uint64_t index) const;
  /// As image(), without textures. @throws ValueError if there are no images
  Tensor<float> crop(Index size, std::uint64_t index) const;
  /// Returns the images given to the constructor.
  const std::vector<Tensor<float>>& images() const { return images_; }

 private:
  std::vector<Tensor<float>> images_;
  CounterRng rng_;
};

}  // namespace fieldmark::baselines
