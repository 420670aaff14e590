#pragma once
// The two methods of conv2d: direct products with the windows of a bordered image, and Winograd's. Private.
#include <fieldmark/engine/tape.h>

namespace fieldmark::detail {

struct ConvGeometry {
  Index n, h, w, c, o, k;                   // of x and of the window
  Index stride = 1, padding = (k - 1) / 2;  // pixels
  Index out_h() const { return (h + 2 * padding - k) / stride + 1; }
  Index out_w() const { return (w + 2 * padding - k) / stride + 1; }
  /// Pixels of the result.
  Index pixels() const { return n * out_h() * out_w(); }
  /// Whether the result is as large as x, with centred windows.
  bool same() const { return stride == 1 && 2 * padding == k - 1; }
  /// The convolution from dY to dX, if same().
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

/// db[c] += the sum of dy [pixels, channels] where the mask is positive: sums of chunks, added in order.
template <class T>
void bias_gradient(Tape<T>& tape, const T* dy, const T* mask, Index pixels, Index channels, T* db);

/// x [n, h, w, c], 0 where the mask is not positive, with a border of zeros, so that every window stays
/// inside; x itself where it needs neither.
template <class T>
const T* with_border(Tape<T>& tape, const ConvGeometry& g, const T* x, const T* mask);
/// The convolution of what with_border() returned.
template <class T>
void direct_products(Tape<T>& tape, const ConvGeometry& g, const T* bordered, const Convolution<T>& c);
/// Both. Returns the bordered x for direct_weight_gradient().
template <class T>
const T* direct_convolve(Tape<T>& tape, const ConvGeometry& g, const Convolution<T>& c);
/// dw += the correlation of x with dy, dy masked. @param bordered  what with_border() returned for x
template <class T>
void direct_weight_gradient(Tape<T>& tape, const ConvGeometry& g, const T* bordered, const T* dy,
                            const T* mask, T* dw);
/// dx = or += dy, masked, scattered over its windows: for any stride and padding.
template <class T>
void direct_input_gradient(Tape<T>& tape, const ConvGeometry& g, const T* w, const T* dy, const T* mask,
                           bool accumulate, T* dx);

/// Whether the two functions below are faster than their direct counterparts; they need k = 3.
bool winograd_pays(const ConvGeometry& g);
template <class T>
void winograd_convolve(Tape<T>& tape, const ConvGeometry& g, const Convolution<T>& c);
template <class T>
void winograd_weight_gradient(Tape<T>& tape, const ConvGeometry& g, const T* x, const T* dy, const T* mask,
                              T* dw);

}  // namespace fieldmark::detail
