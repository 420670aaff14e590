#pragma once
#include <fieldmark/engine/kernel.h>
#include <fieldmark/engine/simd.h>

// For kernel files only, hence the anonymous namespace (fieldmark/engine/simd.h).
namespace {

using fieldmark::Index;

// Pixels that are summed in T before the sum is added to a double: 64 channels of float then fill 8 KiB of
// the L1 cache.
constexpr Index kSegment = 32;

// Calls f(V{}, c) for the channels from c on: with vectors V of `bytes` while they last, then with vectors of
// half the size down to 16 bytes, then with V = T.
template <class T, Index bytes = simd::kBytes, class F>
[[gnu::always_inline]] inline void for_channels(Index channels, F f, Index c = 0) {
  if constexpr (bytes < 16) {
    for (; c < channels; ++c) f(T{}, c);
  } else {
    typedef T Vector __attribute__((vector_size(bytes)));
    constexpr Index lanes = bytes / static_cast<Index>(sizeof(T));
    for (; c + lanes <= channels; c += lanes) f(Vector{}, c);
    for_channels<T, bytes / 2>(channels, f, c);
  }
}

// Loads a vector or a scalar at p.
template <class V, class T>
[[gnu::always_inline]] inline V load_as(const T* p) {
  V v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
template <class V, class T>
[[gnu::always_inline]] inline void store_as(T* p, V v) {
  std::memcpy(p, &v, sizeof v);
}

// sums[k] += v[k].
template <class T, class V>
[[gnu::always_inline]] inline void add_lanes(double* sums, V v) {
  if constexpr (sizeof(V) == sizeof(T)) {
    *sums += static_cast<double>(v);
  } else {
    typedef double Doubles __attribute__((vector_size(sizeof(V) / sizeof(T) * sizeof(double))));
    Doubles sum;
    std::memcpy(&sum, sums, sizeof sum);
    sum += __builtin_convertvector(v, Doubles);
    std::memcpy(sums, &sum, sizeof sum);
  }
}

// Calls f(first, count) for segments of pixels.
template <class F>
[[gnu::always_inline]] inline void for_segments(Index pixels, F f) {
  for (Index p = 0; p < pixels; p += kSegment) f(p, pixels - p < kSegment ? pixels - p : kSegment);
}

}  // namespace
