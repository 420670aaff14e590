#include "kernels/norm.h"

#include "kernels/channels.h"

namespace fieldmark::kernels {
namespace {

// Merges a segment of n pixels with the given mean and squared deviations into the `count` pixels before it
// (Chan et al. 1983).
template <class T, class V>
inline void join(double count, double n, V centre, V residual, V squares, double* mean, double* m2) {
  constexpr std::size_t number = sizeof(T), lanes = sizeof(V) / number;
  T c[lanes], r[lanes], s[lanes];
  std::memcpy(c, &centre, sizeof centre);
  std::memcpy(r, &residual, sizeof residual);
  std::memcpy(s, &squares, sizeof squares);
  for (std::size_t k = 0; k < lanes; ++k) {
    // The centre is the mean only up to rounding; the sum of deviations from it gives the difference.
    const double off = static_cast<double>(r[k]) / n, delta = static_cast<double>(c[k]) + off - mean[k];
    const double own = static_cast<double>(s[k]) - off * off * n;
    mean[k] += delta * n / (count + n);
    m2[k] += (own > 0 ? own : 0) + delta * delta * count * n / (count + n);
  }
}

// Sums `count` pixels, one channel vector each, in four chains: a single chain would wait for its additions.
template <class V, class T, class F>
[[gnu::always_inline]] inline V sum_pixels(const T* x, Index count, Index channels, F f) {
  V s[4] = {};
  Index p = 0;
  for (; p + 4 <= count; p += 4)
    for (int k = 0; k < 4; ++k) s[k] += f(load_as<V>(x + (p + k) * channels));
  for (; p < count; ++p) s[0] += f(load_as<V>(x + p * channels));
  return (s[0] + s[1]) + (s[2] + s[3]);
}

// (x - mean) gain + shift > 0 ? dy : 0.
template <class V, class T>
[[gnu::always_inline]] inline V gate(V centred, V dy, const Affine<T>& a, Index c) {
  if (!a.relu) return dy;
  return centred * load_as<V>(a.gain + c) + load_as<V>(a.shift + c) > 0 ? dy : V{};
}

}  // namespace

namespace FIELDMARK_ISA_NS {

template <class T>
void channel_moments(const T* x, Index pixels, Index channels, double* mean, double* m2) {
  for (Index c = 0; c < channels; ++c) mean[c] = m2[c] = 0;
  for_segments(pixels, [=](Index first, Index n) {
    for_channels<T>(channels, [=](auto zero, Index c) {
      using V = decltype(zero);
      const T* p = x + first * channels + c;
      // The second pass finds the segment in the L1 cache.
      const V centre = sum_pixels<V>(p, n, channels, [](V v) { return v; }) / static_cast<T>(n);
      const V residual = sum_pixels<V>(p, n, channels, [=](V v) { return v - centre; });
      const V squares = sum_pixels<V>(p, n, channels, [=](V v) { return (v - centre) * (v - centre); });
      join<T>(static_cast<double>(first), static_cast<double>(n), centre, residual, squares, mean + c,
              m2 + c);
    });
  });
}

template <class T>
void normalise(const T* x, T* y, Index pixels, Index channels, const Affine<T>& a) {
  for (Index p = 0; p < pixels; ++p, x += channels, y += channels)
    for_channels<T>(channels, [=](auto zero, Index c) {
      using V = decltype(zero);
      const V v =
          (load_as<V>(x + c) - load_as<V>(a.mean + c)) * load_as<V>(a.gain + c) + load_as<V>(a.shift + c);
      store_as(y + c, a.relu ? (v < 0 ? V{} : v) : v);
    });
}

template <class T>
void norm_sums(const T* x, const T* dy, Index pixels, Index channels, const Affine<T>& a, double* sums,
               double* mixed) {
  for (Index c = 0; c < channels; ++c) sums[c] = mixed[c] = 0;
  for_segments(pixels, [=](Index first, Index n) {
    for_channels<T>(channels, [=](auto zero, Index c) {
      using V = decltype(zero);
      V s[2] = {}, m[2] = {};
      const V mean = load_as<V>(a.mean + c);
      for (Index p = 0; p < n; ++p) {
        const Index at = (first + p) * channels + c;
        const V centred = load_as<V>(x + at) - mean, g = gate(centred, load_as<V>(dy + at), a, c);
        s[p & 1] += g;
        m[p & 1] += g * centred;
      }
      add_lanes<T>(sums + c, s[0] + s[1]);
      add_lanes<T>(mixed + c, m[0] + m[1]);
    });
  });
}

template <class T>
void norm_gradient(const T* x, const T* dy, T* dx, Index pixels, Index channels, const Affine<T>& a,
                   const T* offset, const T* slope, bool add) {
  for (Index p = 0; p < pixels; ++p, x += channels, dy += channels, dx += channels)
    for_channels<T>(channels, [=](auto zero, Index c) {
      using V = decltype(zero);
      const V centred = load_as<V>(x + c) - load_as<V>(a.mean + c),
              g = gate(centred, load_as<V>(dy + c), a, c);
      const V d = g * load_as<V>(a.gain + c) - load_as<V>(offset + c) - centred * load_as<V>(slope + c);
      store_as(dx + c, add ? load_as<V>(dx + c) + d : d);
    });
}

#define FIELDMARK_INSTANTIATE(T)                                                                          \
  template void channel_moments(const T*, Index, Index, double*, double*);                                \
  template void normalise(const T*, T*, Index, Index, const Affine<T>&);                                  \
  template void norm_sums(const T*, const T*, Index, Index, const Affine<T>&, double*, double*);          \
  template void norm_gradient(const T*, const T*, T*, Index, Index, const Affine<T>&, const T*, const T*, \
                              bool);
FIELDMARK_INSTANTIATE(float)
FIELDMARK_INSTANTIATE(double)
#undef FIELDMARK_INSTANTIATE

}  // namespace FIELDMARK_ISA_NS
}  // namespace fieldmark::kernels
