#pragma once
#include <fieldmark/engine/tensor.h>
#include <fieldmark/nerf/camera.h>

namespace fieldmark::watermark {

/// A part of an image, pixels; it may reach beyond the image.
struct Window {
  double x = 0;       ///< left edge
  double y = 0;       ///< upper edge
  double width = 0;   ///< to the right
  double height = 0;  ///< downwards
};

/// Size that a window is resampled to.
struct PatchSize {
  Index height = 0;  ///< pixels, at least 1
  Index width = 0;   ///< likewise
  /// Width over height.
  double aspect() const { return static_cast<double>(width) / static_cast<double>(height); }
  /// True if both sides agree.
  bool operator==(const PatchSize&) const = default;
};
/// Returns a size with two equal sides.
constexpr PatchSize square_patch(Index side) { return {side, side}; }

/// Returns the smallest window of the given aspect around all pixels that stand out from a plain background,
/// plus a margin. It makes places of the object look alike whatever the camera's distance, the image's size
/// or its crop. If nothing or nearly everything stands out, the window surrounds the whole image. A pixel
/// stands out if the mean over 5 x 5 pixels of its distance from the background exceeds 0.08: noise of
/// standard deviation 0.1 does not (its mean distance on white is 0.04).
/// @param rgb  [H, W, 3] in [0, 1]   @param background  of all channels   @param aspect  width over height of
/// the window   @throws ShapeError if rgb is not [H, W, 3]   @throws ValueError if aspect is not positive
Window object_window(const Tensor<float>& rgb, float background, double aspect = 1);

/// Cuts a window out of an image and resamples it, with background outside the image: area filter where it
/// shrinks, bilinear where it grows. @throws ValueError if the window has no extent or the size is below 1
Tensor<float> cut_window(const Tensor<float>& rgb, const Window& window, const PatchSize& size,
                         float background);

/// Returns the camera whose whole image, of the given size, is the window.
nerf::Camera window_camera(const nerf::Camera& camera, const Window& window, const PatchSize& size);

}  // namespace fieldmark::watermark
