#include "kernels/pool.h"

#include "kernels/channels.h"

namespace fieldmark::kernels {
namespace {

template <class T, class Load>
void add_pixels(Index pixels, Index channels, double* sums, Load load) {
  for (Index c = 0; c < channels; ++c) sums[c] = 0;
  for_segments(pixels, [=](Index first, Index n) {
    for_channels<T>(channels, [=](auto zero, Index c) {
      using V = decltype(zero);
      V even{}, odd{};  // two sums hide the latency of an addition
      Index p = 0;
      for (; p + 2 <= n; p += 2) {
        even += load(zero, (first + p) * channels + c);
        odd += load(zero, (first + p + 1) * channels + c);
      }
      if (p < n) even += load(zero, (first + p) * channels + c);
      add_lanes<T>(sums + c, even + odd);
    });
  });
}

}  // namespace

namespace FIELDMARK_ISA_NS {

template <class T>
void pool_row(const PoolRow& p, const T* x, T* y) {
  const T share = T(1) / static_cast<T>(p.size * p.size);
  for (Index w = 0; w < p.windows; ++w)
    for_channels<T>(p.channels, [=](auto zero, Index c) {
      using V = decltype(zero);
      V sum{};
      for (Index i = 0; i < p.size; ++i)
        for (Index j = 0; j < p.size; ++j)
          sum += load_as<V>(x + i * p.row + (w * p.size + j) * p.channels + c);
      store_as(y + w * p.channels + c, sum * share);
    });
}

template <class T>
void pool_row_backward(const PoolRow& p, const T* dy, T* dx, bool add) {
  const T share = T(1) / static_cast<T>(p.size * p.size);
  for (Index i = 0; i < p.size; ++i)
    for (Index w = 0; w < p.windows; ++w)
      for (Index j = 0; j < p.size; ++j)
        for_channels<T>(p.channels, [=](auto zero, Index c) {
          using V = decltype(zero);
          T* to = dx + i * p.row + (w * p.size + j) * p.channels + c;
          const V d = load_as<V>(dy + w * p.channels + c) * share;
          store_as(to, add ? load_as<V>(to) + d : d);
        });
  if (add) return;
  for (Index i = 0; i < p.size; ++i)
    for (Index k = p.windows * p.size * p.channels; k < p.row; ++k) dx[i * p.row + k] = 0;
}

template <class T>
void channel_sums(const T* x, const T* mask, Index pixels, Index channels, double* sums) {
  if (mask)
    add_pixels<T>(pixels, channels, sums, [=](auto zero, Index i) {
      using V = decltype(zero);
      return load_as<V>(mask + i) > zero ? load_as<V>(x + i) : zero;
    });
  else
    add_pixels<T>(pixels, channels, sums, [=](auto zero, Index i) { return load_as<decltype(zero)>(x + i); });
}

template <class T>
void fill_pixels(const T* row, Index pixels, Index channels, T* y, bool add) {
  for (Index p = 0; p < pixels; ++p)
    for_channels<T>(channels, [=](auto zero, Index c) {
      using V = decltype(zero);
      T* to = y + p * channels + c;
      store_as(to, add ? load_as<V>(to) + load_as<V>(row + c) : load_as<V>(row + c));
    });
}

template <class T>
void max_pool_row(const MaxPoolRow& p, const T* x, T* y, T* place) {
  for (Index w = 0; w < p.windows; ++w) {
    const Index first = w * p.stride, columns = p.width - first < p.size ? p.width - first : p.size;
    for_channels<T>(p.channels, [=](auto zero, Index c) {
      using V = decltype(zero);
      V best = load_as<V>(x + first * p.channels + c), at{};
      for (Index u = 0; u < p.rows; ++u)
        for (Index v = 0; v < columns; ++v) {
          const V z = load_as<V>(x + (u * p.width + first + v) * p.channels + c);
          const auto take = (z > best) | (z != z);  // a NaN stays: no comparison with it is true
          best = take ? z : best;
          at = take ? zero + static_cast<T>(u * columns + v) : at;
        }
      store_as(y + w * p.channels + c, best);
      if (place) store_as(place + w * p.channels + c, at);
    });
  }
}

template <class T>
void max_pool_row_backward(const MaxPoolRow& p, Index u, const T* dy, const T* place, T* dx) {
  for (Index w = 0; w < p.windows; ++w) {
    const Index first = w * p.stride, columns = p.width - first < p.size ? p.width - first : p.size;
    for (Index v = 0; v < columns; ++v) {
      const T number = static_cast<T>(u * columns + v);
      for_channels<T>(p.channels, [=](auto zero, Index c) {
        using V = decltype(zero);
        T* to = dx + (first + v) * p.channels + c;
        const V d = load_as<V>(dy + w * p.channels + c);
        store_as(to, load_as<V>(to) + (load_as<V>(place + w * p.channels + c) == zero + number ? d : zero));
      });
    }
  }
}

#define FIELDMARK_INSTANTIATE(T)                                                         \
  template void max_pool_row(const MaxPoolRow&, const T*, T*, T*);                       \
  template void max_pool_row_backward(const MaxPoolRow&, Index, const T*, const T*, T*); \
  template void pool_row(const PoolRow&, const T*, T*);                                  \
  template void pool_row_backward(const PoolRow&, const T*, T*, bool);                   \
  template void channel_sums(const T*, const T*, Index, Index, double*);                 \
  template void fill_pixels(const T*, Index, Index, T*, bool);
FIELDMARK_INSTANTIATE(float)
FIELDMARK_INSTANTIATE(double)
#undef FIELDMARK_INSTANTIATE

}  // namespace FIELDMARK_ISA_NS
}  // namespace fieldmark::kernels
