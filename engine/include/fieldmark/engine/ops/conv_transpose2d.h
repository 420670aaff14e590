#pragma once
#include <fieldmark/engine/ops/conv2d.h>

namespace fieldmark {

/// Computes a transposed two-dimensional convolution, which enlarges images: the gradient of conv2d() in its
/// input, plus a bias. With stride s and padding p, each element of x adds a window of weights to the result:
///   y[n, i s + u - p, j s + v - p, o] += sum_c x[n, i, j, c] w[u, v, o, c],   from y = b
/// @param x  [N, H, W, C]   @param w  [K, K, O, C], the weights of a convolution from O channels to C
/// @param b  [O]   @param window  stride and padding only
/// @return [N, (H - 1) s + K - 2 p, (W - 1) s + K - 2 p, O]
/// @throws ShapeError if they do not fit, x has no pixel, or the padding leaves nothing of the result
/// @throws ValueError if stride or padding is out of range, dilation or groups are not 1, or the result with
/// its border has 2^60 elements or more
/// Differentiable in: x, w, b.
template <class T>
Var<T> conv_transpose2d(Var<T> x, Var<T> w, Var<T> b, ConvWindow window = {});

}  // namespace fieldmark
