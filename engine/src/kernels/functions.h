#pragma once
// Functions of one number and their slopes, for kernels that apply them to arrays. Internal linkage, like
// simd.h: two instruction sets must never share an inline function.
#include <fieldmark/engine/simd.h>

#include "kernels/elementwise.h"

namespace fieldmark::kernels {
namespace {

using V = simd::Vec<float>;

// Every function below returns NaN for NaN.
inline V absolute(V x) { return simd::max(x, -x); }

// The scalar twins serve double, through the compiler's builtins: <cmath> must not be included here.
struct Relu {
  static V value(V x) { return x < 0 ? V{} : x; }
  static double value(double x) { return x < 0 ? 0 : x; }
  template <class X>
  static X slope(X x, X) {
    return x > 0 ? X{} + 1 : X{};
  }
};

// e^-|x| / (1 + e^-|x|) or its complement: nothing overflows, and the small tail keeps its relative accuracy.
struct Sigmoid {
  static V value(V x) {
    const V e = simd::exp(-absolute(x));
    return (x < 0 ? e : V{} + 1) / (1 + e);
  }
  static double value(double x) {
    const double e = __builtin_exp(-__builtin_fabs(x));
    return (x < 0 ? e : 1) / (1 + e);
  }
  template <class X>
  static X slope(X, X y) {
    return y * (1 - y);
  }
};

// (1 - e^-2|x|) / (1 + e^-2|x|) loses digits near 0: below 0.625 an interpolating polynomial of tanh(x) / x
// in x^2 replaces it.
struct Tanh {
  static V value(V x) {
    const V a = absolute(x), e = simd::exp(-2 * a), big = (1 - e) / (1 + e), z = x * x;
    V p = -0.00609611917f * z + 0.0209966539f;
    p = p * z - 0.0538507549f;
    p = p * z + 0.13332768f;
    p = p * z - 0.333333289f;
    return a < 0.625f ? x + x * z * p : (x < 0 ? -big : big);
  }
  static double value(double x) { return __builtin_tanh(x); }
  template <class X>
  static X slope(X, X y) {
    return 1 - y * y;
  }
};

struct Exp {
  static V value(V x) { return simd::exp(x); }
  static double value(double x) { return __builtin_exp(x); }
  template <class X>
  static X slope(X, X y) {
    return y;
  }
};

struct TruncatedExp {
  static V value(V x) { return simd::exp(simd::min(V{} + float{kTruncatedExpLimit}, x)); }
  static double value(double x) { return __builtin_exp(x > kTruncatedExpLimit ? kTruncatedExpLimit : x); }
  template <class X>
  static X slope(X, X y) {
    return y;
  }
};

// max(x, 0) + log(1 + e), e = e^-|x|; log(1 + e) = 2 atanh(s), s = e / (2 + e) <= 1/3: a polynomial in s^2.
struct Softplus {
  static V value(V x) {
    const V e = simd::exp(-absolute(x)), s = e / (2 + e), z = s * s;
    V p = 0.268519512f * z + 0.28236532f;
    p = p * z + 0.400075655f;
    p = p * z + 0.666666403f;
    return simd::max(x, V{}) + (2 * s + s * z * p);
  }
  static double value(double x) {
    return (x > 0 ? x : 0) + __builtin_log1p(__builtin_exp(-__builtin_fabs(x)));
  }
  template <class X>
  static X slope(X x, X) {
    return Sigmoid::value(x);
  }
};

// x = 2^e m with m in [sqrt(1/2), sqrt(2)): log m = 2 atanh(s), s = (m - 1) / (m + 1), whose series in s^2 <=
// 0.0295 ends below 2e-9. Subnormal numbers are scaled by 2^23 first.
struct Log {
  static V value(V x) {
    using simd::VecI;
    const V least = V{} + 0x1p-126f, infinity = V{} + __builtin_inff();
    const V scaled = x < least ? x * 0x1p23f : x;
    VecI bits;
    std::memcpy(&bits, &scaled, sizeof bits);
    const VecI mantissa = (bits & 0x7fffff) | 0x3f800000;
    V m, e = __builtin_convertvector((bits >> 23) - 127, V);
    std::memcpy(&m, &mantissa, sizeof m);
    const V half = V{} + 0.5f, one = V{} + 1.0f;
    e += (m > 1.41421356f ? one : V{}) - (x < least ? V{} + 23.0f : V{});
    m *= m > 1.41421356f ? half : one;
    const V s = (m - 1) / (m + 1), z = s * s;
    V p = z * (1.0f / 9) + 1.0f / 7;
    p = p * z + 1.0f / 5;
    p = p * z + 1.0f / 3;
    const V y = e * 0.693359375f + (e * -2.12194440e-4f + (2 * s + 2 * s * z * p));
    const V special = x == 0 ? -infinity : (x < 0 ? V{} + __builtin_nanf("") : x);
    return x > 0 ? (x == infinity ? x : y) : special;
  }
  static double value(double x) { return __builtin_log(x); }
};

}  // namespace
}  // namespace fieldmark::kernels
