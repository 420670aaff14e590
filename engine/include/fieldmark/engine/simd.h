#pragma once
#include <cstdint>
#include <cstring>

// Vectors for kernel files only. Everything has internal linkage, because two instruction sets must never
// share an inline function. GCC and Clang vector extensions replace intrinsics, so that one source serves
// SSE4, AVX2 and AVX-512.
namespace {
namespace simd {

#if defined(__AVX512F__)
inline constexpr int kBytes = 64;
#elif defined(__AVX2__)
inline constexpr int kBytes = 32;
#else
inline constexpr int kBytes = 16;
#endif

/// Elements of type T in one register.
template <class T>
constexpr int kLanes = kBytes / static_cast<int>(sizeof(T));

template <class T>
struct VecOf {
  typedef T type __attribute__((vector_size(kBytes)));
};
template <class T>
using Vec = typename VecOf<T>::type;
using VecI = Vec<std::int32_t>;
using VecU = Vec<std::uint32_t>;

template <class T>
[[gnu::always_inline]] inline Vec<T> load(const T* p) {
  Vec<T> v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
template <class T>
[[gnu::always_inline]] inline void store(T* p, Vec<T> v) {
  std::memcpy(p, &v, sizeof v);
}
template <class T>
[[gnu::always_inline]] inline Vec<T> broadcast(T x) {
  return x - Vec<T>{};
}
template <class V>
[[gnu::always_inline]] inline V max(V a, V b) {
  return a > b ? a : b;
}
template <class V>
[[gnu::always_inline]] inline V min(V a, V b) {
  return a < b ? a : b;
}

/// Returns e^x with a relative error below 2.5e-7 for x in [-87.3, 88]; saturates outside (0 below, the value
/// at 88 above); NaN for NaN. Source: Cody and Waite 1980: x = n log 2 + r, |r| <= log(2) / 2, and a
/// polynomial of degree 6 for e^r.
[[maybe_unused, gnu::always_inline]] inline Vec<float> exp(Vec<float> x) {
  const Vec<float> below = broadcast(-87.33f);
  const Vec<float> c = min(broadcast(88.0f), max(below, x));  // in this order they keep a NaN
  // Adding and subtracting 1.5 * 2^23 rounds to the nearest integer.
  const Vec<float> magic = broadcast(12582912.0f);
  const Vec<float> n = (c * 1.44269504f + magic) - magic;
  const Vec<float> r = (c - n * 0.693359375f) - n * -2.12194440e-4f;
  Vec<float> p = broadcast(1.0f / 720);
  p = p * r + 1.0f / 120;
  p = p * r + 1.0f / 24;
  p = p * r + 1.0f / 6;
  p = p * r + 0.5f;
  p = p * r + 1.0f;
  p = p * r + 1.0f;
  const VecI bits = (__builtin_convertvector(n, VecI) + 127) << 23;
  Vec<float> scale;
  std::memcpy(&scale, &bits, sizeof scale);
  return x < below ? Vec<float>{} : p * scale;
}

}  // namespace simd
}  // namespace
