#include "kernels/gelu.h"

#include <fieldmark/engine/simd.h>

namespace fieldmark::kernels {
namespace {

using V = simd::Vec<float>;

constexpr float kDensity = 0.39894228f;  // 1 / sqrt(2 pi)

// The mass of a normal distribution beyond |x| on one side is bell * tail, with bell = e^(-x^2 / 2). Beyond
// 14 it is 0 in float.
struct Tail {
  V a;  // |x|, at most 14
  V bell, tail;
};

// bell: a = h + d, where h is a multiple of 2^-8 and has an exact square, so that the rounding of a^2, which
// grows with a, does not reach the exponential. tail: erfcx(a / sqrt 2) / 2 as a polynomial in
// t = (a - 3) / (a + 3), a minimax fit in relative terms; its own error is 8e-9, with rounding below 6e-7.
inline Tail tail_of(V x) {
  const V a = simd::min(simd::max(x, -x), V{} + 14);
  const V magic = V{} + 49152;  // 1.5 * 2^15: adding and subtracting it rounds to 2^-8
  const V h = (a + magic) - magic, d = (a - h) * (a + h) * -0.5f;
  const V t = (a - 3) / (a + 3);
  V p = 5.36720727e-05f * t + 1.15543939e-04f;
  p = p * t - 3.39485181e-04f;
  p = p * t - 9.83758597e-04f;
  p = p * t + 2.90455623e-03f;
  p = p * t + 6.13207091e-03f;
  p = p * t - 4.62132916e-02f;
  p = p * t + 1.23225033e-01f;
  p = p * t - 2.06402615e-01f;
  p = p * t + 1.21513948e-01f;
  return {a, simd::exp(h * h * -0.5f) * (1 + d * (1 + d * (0.5f + d * (1.0f / 6)))), p};
}

// x P(x); for positive x, P is the complement of the tail.
inline V value(V x) {
  const Tail s = tail_of(x);
  const V beyond = s.a * (s.bell * s.tail);
  return x == x ? (x < 0 ? -beyond : x - beyond) : x;
}

// P(x) + x p(x), which at -x is 1 minus that.
inline V slope(V x) {
  const Tail s = tail_of(x);
  const V left = s.bell * (s.tail - s.a * kDensity);
  return x == x ? (x < 0 ? left : 1 - left) : x;
}

// The scalar twins serve double, through the compiler's builtins: <cmath> must not be included here.
// Below -40, P(x) is 0 and beyond 40 it is 1, so that infinities, too, go to their limits.
inline double distribution(double x) { return __builtin_erfc(-x / 1.4142135623730950488) / 2; }
inline double value(double x) { return x < -40 ? 0 : x * distribution(x); }
inline double slope(double x) {
  const double a = x < -40 ? -40 : x > 40 ? 40 : x;
  return distribution(a) + a * 0.39894228040143267794 * __builtin_exp(-a * a / 2);
}

// out[i] = f(x[i], dy[i], out[i]); the last vector is padded with zeros.
template <class F>
inline void for_vectors(const float* x, const float* dy, float* out, Index n, F f) {
  constexpr int lanes = simd::kLanes<float>;
  Index i = 0;
  for (; i + lanes <= n; i += lanes)
    simd::store(out + i, f(simd::load(x + i), simd::load(dy + i), simd::load(out + i)));
  if (i == n) return;
  V tail[3] = {};
  const auto bytes = static_cast<std::size_t>(n - i) * sizeof(float);
  std::memcpy(&tail[0], x + i, bytes);
  std::memcpy(&tail[1], dy + i, bytes);
  std::memcpy(&tail[2], out + i, bytes);
  const V last = f(tail[0], tail[1], tail[2]);
  std::memcpy(out + i, &last, bytes);
}
template <class F>
inline void for_vectors(const double* x, const double* dy, double* out, Index n, F f) {
  for (Index i = 0; i < n; ++i) out[i] = f(x[i], dy[i], out[i]);
}

}  // namespace

namespace FIELDMARK_ISA_NS {

template <class T>
void gelu_forward(const T* x, T* y, Index n) {
  for_vectors(x, x, y, n, [](auto v, auto, auto) { return value(v); });
}

template <class T>
void gelu_backward(const T* x, const T* dy, T* dx, bool add, Index n) {
  if (add)
    for_vectors(x, dy, dx, n, [](auto v, auto g, auto old) { return old + g * slope(v); });
  else
    for_vectors(x, dy, dx, n, [](auto v, auto g, auto) { return g * slope(v); });
}

#define FIELDMARK_INSTANTIATE(T)                   \
  template void gelu_forward(const T*, T*, Index); \
  template void gelu_backward(const T*, const T*, T*, bool, Index);
FIELDMARK_INSTANTIATE(float)
FIELDMARK_INSTANTIATE(double)

}  // namespace FIELDMARK_ISA_NS
}  // namespace fieldmark::kernels
