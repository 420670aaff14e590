#include "kernels/feature_distance.h"

#include "kernels/channels.h"

namespace fieldmark::kernels {
namespace {

constexpr double kEpsilon = 1e-10;

// sum over the channels of f(zero, c), vectors of them first.
template <class T, class F>
[[gnu::always_inline]] inline double sum_channels(std::int64_t channels, F f) {
  simd::Vec<T> lanes{};
  double rest = 0;
  constexpr std::int64_t step = simd::kLanes<T>;
  std::int64_t c = 0;
  for (; c + step <= channels; c += step) lanes += f(simd::Vec<T>{}, c);
  for (; c < channels; ++c) rest += static_cast<double>(f(T{}, c));
  for (int k = 0; k < simd::kLanes<T>; ++k) rest += static_cast<double>(lanes[k]);
  return rest;
}

template <class T>
[[gnu::always_inline]] inline double length(const T* x, std::int64_t channels) {
  return __builtin_sqrt(sum_channels<T>(channels, [=](auto zero, std::int64_t c) {
    const auto v = load_as<decltype(zero)>(x + c);
    return v * v;
  }));
}

}  // namespace

namespace FIELDMARK_ISA_NS {

template <class T>
double feature_distance(const FeaturePair<T>& p) {
  double sum = 0;
  for (std::int64_t i = 0; i < p.pixels; ++i) {
    const T *a = p.a + i * p.channels, *b = p.b + i * p.channels, *w = p.w;
    const T sa = static_cast<T>(1 / (length(a, p.channels) + kEpsilon)),
            sb = static_cast<T>(1 / (length(b, p.channels) + kEpsilon));
    sum += sum_channels<T>(p.channels, [=](auto zero, std::int64_t c) {
      using V = decltype(zero);
      const V d = load_as<V>(a + c) * sa - load_as<V>(b + c) * sb;
      return load_as<V>(w + c) * (d * d);
    });
  }
  return sum;
}

template <class T>
void feature_distance_backward(const FeaturePair<T>& p, T share, bool add, T* da) {
  for (std::int64_t i = 0; i < p.pixels; ++i) {
    const T *a = p.a + i * p.channels, *b = p.b + i * p.channels, *w = p.w;
    T* to = da + i * p.channels;
    const double ra = length(a, p.channels);
    const T sa = static_cast<T>(1 / (ra + kEpsilon)),
            sb = static_cast<T>(1 / (length(b, p.channels) + kEpsilon));
    const auto slope = [=](auto zero, std::int64_t c) {
      using V = decltype(zero);
      return 2 * share * load_as<V>(w + c) * (load_as<V>(a + c) * sa - load_as<V>(b + c) * sb);
    };
    const double along = sum_channels<T>(p.channels, [=](auto zero, std::int64_t c) {
      return slope(zero, c) * load_as<decltype(zero)>(a + c);
    });
    // A pixel without features gets no gradient.
    const T straight = ra > 0 ? sa : T(0),
            radial = ra > 0 ? static_cast<T>(along * static_cast<double>(sa) * static_cast<double>(sa) / ra)
                            : T(0);
    for_channels<T>(p.channels, [=](auto zero, std::int64_t c) {
      using V = decltype(zero);
      const V g = slope(zero, c) * straight - load_as<V>(a + c) * radial;
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
