#pragma once
// The methods of conv2d: direct products with the windows of a padded image, the same sums vectorised over
// pixels for few outputs, and Winograd's. Private.
#include <fieldmark/engine/aligned.h>
#include <fieldmark/engine/tape.h>

namespace fieldmark::detail {

struct ConvGeometry {
  Index n, h, w, c, o, k;                   // of x and of the window
  Index stride = 1, padding = (k - 1) / 2;  // pixels
  Index out_h() const { return (h + 2 * padding - k) / stride + 1; }
  Index out_w() const { return (w + 2 * padding - k) / stride + 1; }
  Index padded_h() const { return h + 2 * padding; }
  Index padded_w() const { return w + 2 * padding; }
  /// Returns the number of pixels of the result.
  Index pixels() const { return n * out_h() * out_w(); }
  /// True if the result is as large as x, with centred windows.
  bool same() const { return stride == 1 && 2 * padding == k - 1; }
  /// Returns the convolution from dY to dX; requires same().
  ConvGeometry transposed() const { return {n, h, w, o, c, k}; }
};

/// y = act(bias + x * w), or y += x * w.
template <class T>
struct Convolution {
  const T* x = nullptr;     ///< [n, h, w, c]
  const T* mask = nullptr;  ///< laid out like x: where it is not positive, x counts as 0
  const T* w = nullptr;     ///< [k, k, c, o]
  const T* bias = nullptr;  ///< [o] or null; not with accumulate
  bool relu = false, accumulate = false;
  T* y = nullptr;  ///< [n, h, w, o]
};

/// Returns a thread's own buffer, which stays in the cache from block to block. Only kernels run while it is
/// in use, so that no call nests.
template <class T>
T* workspace(Index elements) {
  static thread_local AlignedVector<T> buffer;
  if (static_cast<Index>(buffer.size()) < elements) buffer.resize(static_cast<std::size_t>(elements));
  return buffer.data();
}

/// db[c] += the sum of dy [pixels, channels] where the mask is positive: sums of chunks, added in order.
template <class T>
void bias_gradient(Tape<T>& tape, const T* dy, const T* mask, Index pixels, Index channels, T* db);

/// Returns x [n, h, w, c] with 0 where the mask is not positive and a border of zeros, so that every window
/// stays inside; x itself if it needs neither. A bordered copy ends with one extra vector of zeros, because
/// few_weight_gradient() reads whole vectors beyond the last window.
template <class T>
const T* with_border(Tape<T>& tape, const ConvGeometry& g, const T* x, const T* mask);
/// Convolves the result of with_border().
template <class T>
void direct_products(Tape<T>& tape, const ConvGeometry& g, const T* bordered, const Convolution<T>& c);
/// Calls with_border() and convolves. Returns the bordered x for direct_weight_gradient().
template <class T>
const T* direct_convolve(Tape<T>& tape, const ConvGeometry& g, const Convolution<T>& c);
/// dw += the correlation of x with the masked dy. @param bordered  the result of with_border() for x
template <class T>
void direct_weight_gradient(Tape<T>& tape, const ConvGeometry& g, const T* bordered, const T* dy,
                            const T* mask, T* dw);
/// Returns dy [size] with 0 where the mask is not positive; dy itself without a mask.
template <class T>
const T* masked(Tape<T>& tape, const T* dy, const T* mask, Index size);
/// dx = or += the masked dy scattered over its windows, for any stride and padding.
template <class T>
void direct_input_gradient(Tape<T>& tape, const ConvGeometry& g, const T* w, const T* dy, const T* mask,
                           bool accumulate, T* dx);

/// True if few_convolve() and few_weight_gradient() are faster than their direct counterparts, which give the
/// same bits.
template <class T>
bool few_outputs_pay(const ConvGeometry& g);
template <class T>
void few_convolve(Tape<T>& tape, const ConvGeometry& g, const Convolution<T>& c);
template <class T>
void few_weight_gradient(Tape<T>& tape, const ConvGeometry& g, const T* x, const T* dy, const T* mask, T* dw);

/// True if the two functions below are faster than their direct counterparts; they need k = 3.
bool winograd_pays(const ConvGeometry& g);
template <class T>
void winograd_convolve(Tape<T>& tape, const ConvGeometry& g, const Convolution<T>& c);
template <class T>
void winograd_weight_gradient(Tape<T>& tape, const ConvGeometry& g, const T* x, const T* dy, const T* mask,
                              T* dw);

}  // namespace fieldmark::detail
