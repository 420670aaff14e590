#include "kernels/feature_distance.h"

#include "kernels/channels.h"

namespace fieldmark::kernels {
namespace {

constexpr double kEpsilon = 1e-10;

// Sums f(zero, c) over the channels, whole vectors first.
template <class T, class F>
[[gnu::always_inline]] inline double sum_channels(Index channels, F f) {
  simd::Vec<T> lanes{};
  double rest = 0;
  constexpr Index step = simd::kLanes<T>;
  Index c = 0;
  for (; c + step <= channels; c += step) lanes += f(simd::Vec<T>{}, c);
  for (; c < channels; ++c) rest += static_cast<double>(f(T{}, c));
  for (int k = 0; k < simd::kLanes<T>; ++k) rest += static_cast<double>(lanes[k]);
  return rest;
}

template <class T>
[[gnu::always_inline]] inline double length(const T* x, Index channels) {
  return __builtin_sqrt(sum_channels<T>(channels, [=](auto zero, Index c) {
    const auto v = load_as<decltype(zero)>(x + c);
    return v * v;
  }));
}

// d_c = a_c / (|a| + e) - b_c / (|b| + e) of one pixel, as (a_c - b_c) s_a + b_c (s_a - s_b): 0 where
// a = b, whichever products the compiler fuses, and as exact as the features where they nearly agree.
template <class T>
struct Difference {
  const T *a, *b;
  double length_a, scale_a;
  T scale, change;
  Difference(const T* first, const T* second, Index channels)
      : a(first), b(second), length_a(length(a, channels)), scale_a(1 / (length_a + kEpsilon)) {
    scale = static_cast<T>(scale_a);
    change = static_cast<T>(scale_a - 1 / (length(b, channels) + kEpsilon));
  }
  template <class V>
  [[gnu::always_inline]] V at(Index c) const {
    const V y = load_as<V>(b + c);
    return (load_as<V>(a + c) - y) * scale + y * change;
  }
};

}  // namespace

namespace FIELDMARK_ISA_NS {

template <class T>
double feature_distance(const FeaturePair<T>& p) {
  double sum = 0;
  for (Index i = 0; i < p.pixels; ++i) {
    const Difference<T> d(p.a + i * p.channels, p.b + i * p.channels, p.channels);
    sum += sum_channels<T>(p.channels, [=, &d](auto zero, Index c) {
      using V = decltype(zero);
      const V v = d.template at<V>(c);
      return load_as<V>(p.w + c) * (v * v);
    });
  }
  return sum;
}

template <class T>
void feature_distance_backward(const FeaturePair<T>& p, T share, bool add, T* da) {
  for (Index i = 0; i < p.pixels; ++i) {
    const Difference<T> d(p.a + i * p.channels, p.b + i * p.channels, p.channels);
    T* to = da + i * p.channels;
    const auto slope = [=, &d](auto zero, Index c) {
      using V = decltype(zero);
      return 2 * share * load_as<V>(p.w + c) * d.template at<V>(c);
    };
    const double along = sum_channels<T>(p.channels, [=, &d](auto zero, Index c) {
      return slope(zero, c) * load_as<decltype(zero)>(d.a + c);
    });
    // A pixel without features gets no gradient.
    const bool any = d.length_a > 0;
    const T straight = any ? d.scale : T(0),
            radial = any ? static_cast<T>(along * d.scale_a * d.scale_a / d.length_a) : T(0);
    for_channels<T>(p.channels, [=, &d](auto zero, Index c) {
      using V = decltype(zero);
      const V g = slope(zero, c) * straight - load_as<V>(d.a + c) * radial;
      store_as(to + c, add ? load_as<V>(to + c) + g : g);
    });
  }
}

#define FIELDMARK_INSTANTIATE(T)                           \
  template double feature_distance(const FeaturePair<T>&); \
  template void feature_distance_backward(const FeaturePair<T>&, T, bool, T*);
FIELDMARK_INSTANTIATE(float)
FIELDMARK_INSTANTIATE(double)
#undef FIELDMARK_INSTANTIATE

}  // namespace FIELDMARK_ISA_NS
}  // namespace fieldmark::kernels
