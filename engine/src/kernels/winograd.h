#pragma once
#include <fieldmark/engine/kernel.h>

// The transforms of Winograd's convolution F(4 x 4, 3 x 3) and of its weight gradient F(3 x 3, 4 x 4): a
// window of 6 x 6 pixels and a tile of 4 x 4 outputs meet in 36 products for each pair of channels, where the
// definition takes 144. Source: Lavin & Gray 2016, section 4, at the points 0, +-1/sqrt 2, +-sqrt 2
// and infinity instead of their 0, +-1, +-2 and infinity (ops/conv2d_winograd.cpp has the errors of both).
namespace fieldmark::kernels {

constexpr Index kWinogradTile = 4;       // outputs of a tile along an axis
constexpr Index kWinogradProducts = 36;  // elements of a transformed tile

/// 36 matrices with a stride of `stride` elements, in panels like those of pack_panels(): element [row,
/// column] is at (column / panel) distance + row panel + column % panel. One panel at least as
/// wide as the matrix is row-major.
template <class T>
struct WinogradMatrices {
  T* data = nullptr;
  Index stride = 0, panel = 0, distance = 0;
};

/// Tiles first .. first + count of the images [n, h, w, channels], numbered image by image and row by
/// row; there are ceil(h / 4) ceil(w / 4) in an image. Where `mask` (laid out like the images) is not
/// positive, an element counts as 0.
template <class T>
struct WinogradTiles {
  const T* data = nullptr;
  const T* mask = nullptr;
  Index h = 0, w = 0, channels = 0;
  Index first = 0, count = 0;
};

/// Destination of the outputs: adds y's old value or the bias, then may apply a ReLU.
template <class T>
struct WinogradOutput {
  T* y = nullptr;           ///< laid out as in WinogradTiles
  const T* bias = nullptr;  ///< [channels] or null; not with accumulate
  bool accumulate = false, relu = false;
};

/// to[:, tile, c] = B^T X B of the window x[4 i - 1 .. 4 i + 4, 4 j - 1 .. 4 j + 4, c] (zeros outside).
FIELDMARK_DECLARE_KERNEL(template <class T> void, winograd_windows,
                         (const WinogradTiles<T>& x, const WinogradMatrices<T>& to))
/// to[:, tile, o] = A D A^T of the tile dy[4 i .. 4 i + 3, 4 j .. 4 j + 3, o] (zeros outside).
FIELDMARK_DECLARE_KERNEL(template <class T> void, winograd_tiles,
                         (const WinogradTiles<T>& dy, const WinogradMatrices<T>& to))
/// to[:, c, o] = G w[:, :, c, o] G^T for c in [first, first + count) of w [3, 3, c_in, c_out].
FIELDMARK_DECLARE_KERNEL(template <class T> void, winograd_weights,
                         (const T* w, Index c_in, Index c_out, Index first, Index count,
                          const WinogradMatrices<T>& to))
/// y's tile = A^T m[:, tile, o] A; tiles.data is not read.
FIELDMARK_DECLARE_KERNEL(template <class T> void, winograd_outputs,
                         (const WinogradTiles<T>& tiles, const WinogradMatrices<const T>& m,
                          const WinogradOutput<T>& out))
/// dw[:, :, c, o] += G^T m[:, c, o] G for dw [3, 3, c_in, c_out]; m is row-major.
FIELDMARK_DECLARE_KERNEL(template <class T> void, winograd_weight_gradient,
                         (const WinogradMatrices<const T>& m, Index c_in, Index c_out, T* dw))

}  // namespace fieldmark::kernels
