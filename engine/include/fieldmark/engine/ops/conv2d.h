#pragma once
#include <fieldmark/engine/ops/dense.h>

namespace fieldmark {

/// How conv2d() computes: Winograd's way where it is faster, or always the sums as they are written.
enum class ConvMethod { fastest, direct };

/// Two-dimensional convolution (cross-correlation) of images, stride 1, zeros around, same size.
///   y[n, i, j, o] = act(b[o] + sum_{u, v, c} x[n, i + u - r, j + v - r, c] w[u, v, c, o]),   r = (K - 1) / 2
/// Wide layers with K = 3 take Winograd's way (Lavin & Gray 2016), which computes tiles of 4 x 4 outputs. In
/// float its errors are parts of the largest number of a tile, below 5e-6 of it up to 512 channels, and a NaN
/// or an infinity in x makes NaN of such tiles, though of no output more than 4 pixels away.
/// @param x  [N, H, W, C]   @param w  [K, K, C, O], K odd   @param b  [O]   @return [N, H, W, O]
/// @param method  direct costs up to three times as much, and keeps a NaN to the outputs that see it
/// @throws ShapeError if they do not fit or K is even
/// Differentiable in: x, w, b. With relu: a kink where the sum is 0, gradient 0 there.
template <class T>
Var<T> conv2d(Var<T> x, Var<T> w, Var<T> b, Activation activation = Activation::none,
              ConvMethod method = ConvMethod::fastest);

/// How the window of conv2d() moves where it does not visit every pixel, or the border is not half a window.
struct ConvSteps {
  Index stride = 1;   ///< pixels from one window to the next, both ways, >= 1
  Index padding = 0;  ///< pixels of zeros around the image, >= 0
};

/// The same with steps of `stride` pixels inside a border of `padding` zeros.
///   y[n, i, j, o] = act(b[o] + sum_{u, v, c} x[n, i s + u - p, j s + v - p, c] w[u, v, c, o])
/// @param x  [N, H, W, C]   @param w  [K, K, C, O], any K   @param b  [O]
/// @return [N, (H + 2 p - K) / s + 1, (W + 2 p - K) / s + 1, O], rounded down
/// @throws ShapeError if they do not fit or the image with its border is smaller than the window
/// @throws ValueError if stride or padding is out of range
/// Differentiable in: x, w, b. With relu: a kink where the sum is 0, gradient 0 there.
template <class T>
Var<T> conv2d(Var<T> x, Var<T> w, Var<T> b, ConvSteps steps, Activation activation = Activation::none);

}  // namespace fieldmark
