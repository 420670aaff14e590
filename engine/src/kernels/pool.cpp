#include "kernels/pool.h"

#include "kernels/channels.h"

namespace fieldmark::kernels {
namespace {

template <class T>
void forward(const PoolRow& p, const T* x, T* y) {
  const T share = T(1) / static_cast<T>(p.size * p.size);
  for (std::int64_t w = 0; w < p.windows; ++w)
    for_channels<T>(p.channels, [=](auto zero, std::int64_t c) {
      using V = decltype(zero);
      V sum{};
      for (std::int64_t i = 0; i < p.size; ++i)
        for (std::int64_t j = 0; j < p.size; ++j)
          sum += load_as<V>(x + i * p.row + (w * p.size + j) * p.channels + c);
      store_as(y + w * p.channels + c, sum * share);
    });
}

template <class T>
void backward(const PoolRow& p, const T* dy, T* dx, bool add) {
  const T share = T(1) / static_cast<T>(p.size * p.size);
  for (std::int64_t i = 0; i < p.size; ++i)
    for (std::int64_t w = 0; w < p.windows; ++w)
      for (std::int64_t j = 0; j < p.size; ++j)
        for_channels<T>(p.channels, [=](auto zero, std::int64_t c) {
          using V = decltype(zero);
          T* to = dx + i * p.row + (w * p.size + j) * p.channels + c;
          const V d = load_as<V>(dy + w * p.channels + c) * share;
          store_as(to, add ? load_as<V>(to) + d : d);
        });
  if (add) return;
  for (std::int64_t i = 0; i < p.size; ++i)
    for (std::int64_t k = p.windows * p.size * p.channels; k < p.row; ++k) dx[i * p.row + k] = 0;
}

template <class T, class Load>
void add_pixels(std::int64_t pixels, std::int64_t channels, double* sums, Load load) {
  for (std::int64_t c = 0; c < channels; ++c) sums[c] = 0;
  for_segments(pixels, [=](std::int64_t first, std::int64_t n) {
    for_channels<T>(channels, [=](auto zero, std::int64_t c) {
      using V = decltype(zero);
      V s[2] = {};
      for (std::int64_t p = 0; p < n; ++p) s[p & 1] += load(zero, (first + p) * channels + c);
      add_lanes<T>(sums + c, s[0] + s[1]);
    });
  });
}

template <class T>
void fill(const T* row, std::int64_t pixels, std::int64_t channels, T* y, bool add) {
  for (std::int64_t p = 0; p < pixels; ++p)
    for_channels<T>(channels, [=](auto zero, std::int64_t c) {
      using V = decltype(zero);
      T* to = y + p * channels + c;
      store_as(to, add ? load_as<V>(to) + load_as<V>(row + c) : load_as<V>(row + c));
    });
}

}  // namespace

namespace FIELDMARK_ISA_NS {

template <class T>
void pool_row(const PoolRow& p, const T* x, T* y) {
  forward(p, x, y);
}
template <class T>
void pool_row_backward(const PoolRow& p, const T* dy, T* dx, bool add) {
  backward(p, dy, dx, add);
}
template <class T>
void channel_sums(const T* x, const T* mask, std::int64_t pixels, std::int64_t channels, double* sums) {
  if (mask)
    add_pixels<T>(pixels, channels, sums, [=](auto zero, std::int64_t i) {
      using V = decltype(zero);
      return load_as<V>(mask + i) > zero ? load_as<V>(x + i) : zero;
    });
  else
    add_pixels<T>(pixels, channels, sums,
                  [=](auto zero, std::int64_t i) { return load_as<decltype(zero)>(x + i); });
}
template <class T>
void fill_pixels(const T* row, std::int64_t pixels, std::int64_t channels, T* y, bool add) {
  fill(row, pixels, channels, y, add);
}

#define FIELDMARK_INSTANTIATE(T)                                                       \
  template void pool_row(const PoolRow&, const T*, T*);                                \
  template void pool_row_backward(const PoolRow&, const T*, T*, bool);                 \
  template void channel_sums(const T*, const T*, std::int64_t, std::int64_t, double*); \
  template void fill_pixels(const T*, std::int64_t, std::int64_t, T*, bool);
FIELDMARK_INSTANTIATE(float)
FIELDMARK_INSTANTIATE(double)
#undef FIELDMARK_INSTANTIATE

}  // namespace FIELDMARK_ISA_NS
}  // namespace fieldmark::kernels
