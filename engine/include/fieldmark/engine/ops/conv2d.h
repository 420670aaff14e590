#pragma once
#include <fieldmark/engine/ops/dense.h>

namespace fieldmark {

/// Method of conv2d(): the fastest, which is Winograd's for wide layers, or always direct sums.
enum class ConvMethod { fastest, direct };

/// Computes a two-dimensional convolution (cross-correlation) of images with stride 1, zero-padded to the
/// same size.
///   y[n, i, j, o] = act(b[o] + sum_{u, v, c} x[n, i + u - r, j + v - r, c] w[u, v, c, o]),   r = (K - 1) / 2
/// Wide layers with K = 3 use Winograd's method (Lavin & Gray 2016) on tiles of 4 x 4 outputs. Its float
/// error is below 5e-6 relative to the largest magnitude of a tile, up to 512 channels. A NaN or an infinity
/// in x makes its tiles NaN, at most 4 pixels away.
/// @param x  [N, H, W, C]   @param w  [K, K, C, O], K odd   @param b  [O]   @return [N, H, W, O]
/// @param method  direct takes up to three times as long and confines a NaN to the windows that contain it
/// @throws ShapeError if they do not fit or K is even
/// Differentiable in: x, w, b. With relu: a kink where the sum is 0, gradient 0 there.
template <class T>
Var<T> conv2d(Var<T> x, Var<T> w, Var<T> b, Activation activation = Activation::none,
              ConvMethod method = ConvMethod::fastest);

/// Geometry of the windows of conv2d(). None is above 2147483647.
struct ConvWindow {
  Index stride = 1;    ///< pixels from one window to the next, both ways, >= 1
  Index padding = 0;   ///< pixels of zeros around the image, >= 0
  Index dilation = 1;  ///< pixels from one element of a window to the next, both ways, >= 1
  Index groups = 1;    ///< channel groups, dividing C and O: a group of outputs sees one group of inputs
};

/// Overload with a stride s, a padding p, a dilation d and G groups. c runs over the channels of o's group:
///   y[n, i, j, o] = act(b[o] + sum_{u, v, c} x[n, i s + u d - p, j s + v d - p, c] w[u, v, c mod C / G, o])
/// The window covers L = (K - 1) d + 1 pixels. A dilated window takes as long as one of L x L elements.
/// Groups run one after another.
/// @param x  [N, H, W, C]   @param w  [K, K, C / G, O], any K   @param b  [O]
/// @return [N, (H + 2 p - L) / s + 1, (W + 2 p - L) / s + 1, O], rounded down
/// @throws ShapeError if they do not fit or the padded image is smaller than the window
/// @throws ValueError if stride, padding, dilation or groups is out of range, the window exceeds 2147483647
/// pixels, or the padded image has 2^60 elements or more
/// Differentiable in: x, w, b. With relu: a kink where the sum is 0, gradient 0 there.
template <class T>
Var<T> conv2d(Var<T> x, Var<T> w, Var<T> b, ConvWindow steps, Activation activation = Activation::none);

}  // namespace fieldmark
