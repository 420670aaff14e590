#include "kernels/winograd.h"
#include "ops/conv2d_parts.h"
#include "ops/product.h"

// Winograd's method for windows of 3 x 3: y = A^T [(G w G^T) . (B^T x B)] A for each tile of 4 x 4 outputs,
// summed over channels between the brackets, which is 36 products of matrices [tiles, C] [C, O]
// (kernels/winograd.h). With dY instead of y, the same three matrices give the gradient of the weights,
//   dw = G^T [sum over tiles (B^T x B) . (A dY A^T)] G,
// and dX is the convolution of dY with the flipped weights. The method needs 4 times fewer multiplications
// than the definition; with the transforms, the speed-up is 2.7 forward and 2.6 with gradients (64 channels,
// AVX-512, one core).
//
// Maximum absolute error relative to the largest magnitude, uniform random images and weights, direct method
// in brackets:
//   channels    y                    dX                   dW
//   64          1.7e-6 (1.1e-6)      1.7e-6 (1.1e-6)      8.5e-7 (1.7e-6)
//   256         3.0e-6 (2.1e-6)      2.6e-6 (1.9e-6)      7.5e-7 (1.9e-6)
//   512         4.1e-6 (2.4e-6)      4.5e-6 (3.3e-6)      7.3e-7 (1.8e-6)
// and less where x has an offset of 1000. With the points 0, +-1, +-2 of the paper y is 4 times worse (5.9e-6
// at 64 channels and 1.4e-5 at 512 against 1.3e-6 and 3.2e-6 in a plain emulation); +-1/sqrt 2 and +-sqrt 2
// were the best of nine pairs tried. F(2 x 2, 3 x 3), 5.3e-7 and 8.2e-7 there, saves only 2.25 times the
// multiplications.

namespace fieldmark::detail {
namespace {

using kernels::kWinogradProducts;
using kernels::kWinogradTile;
using kernels::WinogradMatrices;
using kernels::WinogradTiles;

// Tiles per block, a multiple of the rows of register blocks (kernels/gemm.cpp): with 64 channels, the
// transformed tiles, the products and the weights take 1.2 MiB; with hundreds of channels, the weights are
// not read too often.
constexpr Index kBlock = 36;

Index tiles_along(Index extent) { return (extent + kWinogradTile - 1) / kWinogradTile; }
Index tiles_of(const ConvGeometry& g) { return g.n * tiles_along(g.h) * tiles_along(g.w); }

// Pads the stride: 36 elements a power of 2 apart would share few sets of the cache.
Index padded(Index elements) { return round_up(elements, Index{16}) + 16; }

template <class T>
WinogradMatrices<T> row_major(T* data, Index rows, Index columns) {
  return {data, padded(rows * columns), columns, Index{0}};
}
// Rows of whole vectors, so that a product writes no part of one.
template <class T>
WinogradMatrices<T> in_whole_rows(T* data, Index rows, Index columns) {
  return row_major<T>(data, rows, whole_row<T>(columns));
}
template <class T>
WinogradMatrices<T> in_panels(T* data, Index rows, Index columns) {
  const Index panel = panel_width<T>(columns);
  return {data, padded(rows * round_up(columns, panel)), panel, rows * panel};
}

}  // namespace

// Measured on one core with AVX-512: with 8 input and 8 output channels Winograd takes 1.2 times as long;
// with 12 and 12 or 8 and 64 it is 1.2 and 1.7 times faster, with 64 and 64 2.5 times. Fewer than 6 pixels
// per tile (a row of pixels; 5 x 5 has 6.25) waste the products. Transforming the weights pays from 4 tiles
// on while they stay in L2, else from 32 (256 channels: 1.4 times slower at 16 tiles, 1.2 times faster at
// 36). The number of images is ignored, so that an image alone has the same bits as in a batch.
bool winograd_pays(const ConvGeometry& g) {
  const Index tiles = tiles_along(g.h) * tiles_along(g.w);
  return g.k == 3 && g.same() && std::min(g.c, g.o) >= 8 && g.c + g.o >= 24 && g.h * g.w >= 6 * tiles &&
         tiles >= (g.c * g.o <= 4096 ? 4 : 32);
}

template <class T>
void winograd_convolve(Tape<T>& tape, const ConvGeometry& g, const Convolution<T>& c) {
  using namespace kernels;
  WinogradMatrices<T> weights = in_panels<T>(nullptr, g.c, g.o);
  weights.data = tape.scratch(kWinogradProducts * weights.stride);
  const auto transform_weights = FIELDMARK_KERNEL(winograd_weights<T>);
  parallel_for(g.c, 16, [&](Index begin, Index end) {
    transform_weights(c.w, g.c, g.o, begin, end - begin, weights);
  });
  const auto transform = FIELDMARK_KERNEL(winograd_windows<T>);
  const auto multiply = FIELDMARK_KERNEL(gemm<T>);
  const auto finish = FIELDMARK_KERNEL(winograd_outputs<T>);
  parallel_for(tiles_of(g), kBlock, [&](Index begin, Index end) {
    WinogradMatrices<T> v = row_major<T>(nullptr, kBlock, g.c), m = in_whole_rows<T>(nullptr, kBlock, g.o);
    v.data = workspace<T>(kWinogradProducts * (v.stride + m.stride));
    m.data = v.data + kWinogradProducts * v.stride;
    WinogradTiles<T> tiles{c.x, c.mask, g.h, g.w, g.c, begin, end - begin};
    transform(tiles, v);
    for (Index k = 0; k < kWinogradProducts; ++k)
      multiply({.m = end - begin,
                .n = m.panel,
                .k = g.c,
                .a = v.data + k * v.stride,
                .a_row = g.c,
                .b = weights.data + k * weights.stride,
                .c = m.data + k * m.stride,
                .ldc = m.panel});
    tiles.channels = g.o;
    finish(tiles, {m.data, m.stride, m.panel, m.distance}, {c.y, c.bias, c.accumulate, c.relu});
  });
}

// A shard's sums over its tiles stay in the workspace until they shrink from 36 to 9 elements.
template <class T>
void winograd_weight_gradient(Tape<T>& tape, const ConvGeometry& g, const T* x, const T* dy, const T* mask,
                              T* dw) {
  using namespace kernels;
  const auto windows = FIELDMARK_KERNEL(winograd_windows<T>);
  const auto tiles = FIELDMARK_KERNEL(winograd_tiles<T>);
  const auto multiply = FIELDMARK_KERNEL(gemm<T>);
  const auto finish = FIELDMARK_KERNEL(winograd_weight_gradient<T>);
  sharded_sum(tape, tiles_of(g), kBlock, dw, 9 * g.c * g.o, [&](Index first, Index last, T* to) {
    WinogradMatrices<T> v = row_major<T>(nullptr, kBlock, g.c), d = in_panels<T>(nullptr, kBlock, g.o),
                        m = in_whole_rows<T>(nullptr, g.c, g.o);
    v.data = workspace<T>(kWinogradProducts * (v.stride + d.stride + m.stride));
    d.data = v.data + kWinogradProducts * v.stride;
    m.data = d.data + kWinogradProducts * d.stride;
    for (Index begin = first; begin < last; begin += kBlock) {
      const Index count = std::min(kBlock, last - begin);
      windows({x, nullptr, g.h, g.w, g.c, begin, count}, v);
      tiles({dy, mask, g.h, g.w, g.o, begin, count}, d);
      for (Index k = 0; k < kWinogradProducts; ++k)
        multiply({.m = g.c,
                  .n = m.panel,
                  .k = count,
                  .a = v.data + k * v.stride,
                  .a_row = 1,
                  .a_col = g.c,
                  .b = d.data + k * d.stride,
                  .b_panel = d.distance,
                  .c = m.data + k * m.stride,
                  .ldc = m.panel,
                  .accumulate = begin > first});
    }
    if (last > first) finish({m.data, m.stride, m.panel, m.distance}, g.c, g.o, to);
  });
}

#define FIELDMARK_INSTANTIATE(T)                                                         \
  template void winograd_convolve(Tape<T>&, const ConvGeometry&, const Convolution<T>&); \
  template void winograd_weight_gradient(Tape<T>&, const ConvGeometry&, const T*, const T*, const T*, T*);
FIELDMARK_INSTANTIATE(float)
FIELDMARK_INSTANTIATE(double)
#undef FIELDMARK_INSTANTIATE

}  // namespace fieldmark::detail
