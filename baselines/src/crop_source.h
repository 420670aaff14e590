#pragma once
#include <fieldmark/engine/random.h>
#include <fieldmark/engine/tensor.h>

#include <vector>

namespace fieldmark::baselines {

/// Whether an image in [0, 1] is more than a plain background: values whose standard deviation exceeds 0.03.
bool shows_something(const Tensor<float>& image);

/// The part of an image [H, W, 3] that begins at row `top` and column `left`, both inside it; edges are
/// repeated beyond it.   @param shape  of the part, [h, w, 3]
Tensor<float> window_of(const Tensor<float>& image, Index top, Index left, const Shape& shape);

/// An image without a scene: several octaves of smooth noise between random colours over a ramp.
/// @param index  one image for each   @return [size, size, 3] in [0, 1]   @throws ValueError if size < 1
Tensor<float> generated_texture(Index size, const CounterRng& rng, std::uint64_t index);

/// Training images of 2-D networks: windows of images at random places and, one in two, generated
/// textures.
class CropSource {
 public:
  /// @param images  [H, W, 3] in [0, 1] of any sizes; none: textures alone
  /// @throws ShapeError if one is not
  CropSource(std::vector<Tensor<float>> images, std::uint64_t seed);
  /// Draws a random window of an image, or a texture. An image smaller than `size` is extended by its edge
  /// pixels. A window that shows hardly anything is drawn again, up to 8 times.
  /// @param index  one image for each   @return [size, size, 3] in [0, 1]
  Tensor<float> image(Index size, std::uint64_t index) const;
  /// The same of images alone. @throws ValueError if there is none
  Tensor<float> crop(Index size, std::uint64_t index) const;
  /// The options given to the constructor.
  const std::vector<Tensor<float>>& images() const { return images_; }

 private:
  std::vector<Tensor<float>> images_;
  CounterRng rng_;
};

}  // namespace fieldmark::baselines
