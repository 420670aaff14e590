#pragma once
// The two ways of conv2d: directly, as products with the windows of a bordered picture, and Winograd's.
// Private.
#include <fieldmark/engine/tape.h>

namespace fieldmark::detail {

struct ConvGeometry {
  Index n, h, w, c, o, k;
  Index pixels() const { return n * h * w; }
  /// Of the convolution that takes dY to dX.
  ConvGeometry transposed() const { return {n, h, w, o, c, k}; }
};

/// y = act(bias + x * w), or y += x * w.
template <class T>
struct Convolution {
  const T* x = nullptr;     ///< [n, h, w, c]
  const T* mask = nullptr;  ///< laid out as x: where it is not positive, x counts as 0
  const T* w = nullptr;     ///< [k, k, c, o]
  const T* bias = nullptr;  ///< [o] or null; not with accumulate
  bool relu = false, accumulate = false;
  T* y = nullptr;  ///< [n, h, w, o]
};

/// Returns x with a border of zeros, which direct_weight_gradient() reads again.
template <class T>
const T* direct_convolve(Tape<T>& tape, const ConvGeometry& g, const Convolution<T>& c);
/// dw += the correlation of x with dy, dy masked. @param bordered  what direct_convolve() returned
template <class T>
void direct_weight_gradient(Tape<T>& tape, const ConvGeometry& g, const T* bordered, const T* dy,
                            const T* mask, T* dw);

/// Whether the two below take less time than the two above; they need k = 3.
bool winograd_pays(const ConvGeometry& g);
template <class T>
void winograd_convolve(Tape<T>& tape, const ConvGeometry& g, const Convolution<T>& c);
template <class T>
void winograd_weight_gradient(Tape<T>& tape, const ConvGeometry& g, const T* x, const T* dy, const T* mask,
                              T* dw);

}  // namespace fieldmark::detail
