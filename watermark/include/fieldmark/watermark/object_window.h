#pragma once
#include <fieldmark/engine/tensor.h>
#include <fieldmark/nerf/camera.h>

namespace fieldmark::watermark {

/// A square part of a picture, pixels; it may reach beyond the picture.
struct Window {
  double x = 0;     ///< left edge
  double y = 0;     ///< upper edge
  double side = 0;  ///< of both sides
};

/// The square around what stands out from a plain background, with a margin: places of the object then look
/// alike whatever the camera's distance, the picture's size or where it was cut. Where nothing or nearly
/// everything stands out, the square around the whole picture. A pixel stands out if the mean over 5 x 5
/// pixels of its distance from the background exceeds 0.08: noise of deviation 0.1 does not (its mean
/// distance on white is 0.04).
/// @param rgb  [H, W, 3] in [0, 1]   @param background  of all channels   @throws ShapeError if rgb is not
/// [H, W, 3]
Window object_window(const Tensor<float>& rgb, float background);

/// The part of a picture in a window, size x size pixels, background outside: area filter where it shrinks,
/// bilinear where it grows. @throws ValueError if the window has no extent or size is below 1
Tensor<float> cut_window(const Tensor<float>& rgb, const Window& window, Index size, float background);

/// The camera that sees the window as its whole picture of size x size pixels.
nerf::Camera window_camera(const nerf::Camera& camera, const Window& window, Index size);

}  // namespace fieldmark::watermark
