#include "kernels/elementwise.h"

#include <fieldmark/engine/simd.h>

namespace fieldmark::kernels {
namespace {

using V = simd::Vec<float>;

// Every function below returns NaN for NaN: simd::exp would hide it.
inline V keep_nan(V x, V y) { return x == x ? y : x; }
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
    return keep_nan(x, (x < 0 ? e : V{} + 1) / (1 + e));
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
// in x^2.
struct Tanh {
  static V value(V x) {
    const V a = absolute(x), e = simd::exp(-2 * a), big = (1 - e) / (1 + e), z = x * x;
    V p = -0.00609611917f * z + 0.0209966539f;
    p = p * z - 0.0538507549f;
    p = p * z + 0.13332768f;
    p = p * z - 0.333333289f;
    return keep_nan(x, a < 0.625f ? x + x * z * p : (x < 0 ? -big : big));
  }
  static double value(double x) { return __builtin_tanh(x); }
  template <class X>
  static X slope(X, X y) {
    return 1 - y * y;
  }
};

struct Exp {
  static V value(V x) { return keep_nan(x, simd::exp(x)); }
  static double value(double x) { return __builtin_exp(x); }
  template <class X>
  static X slope(X, X y) {
    return y;
  }
};

struct TruncatedExp {
  static V value(V x) { return keep_nan(x, simd::exp(simd::min(x, V{} + float{kTruncatedExpLimit}))); }
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
    return keep_nan(x, simd::max(x, V{}) + (2 * s + s * z * p));
  }
  static double value(double x) {
    return (x > 0 ? x : 0) + __builtin_log1p(__builtin_exp(-__builtin_fabs(x)));
  }
  template <class X>
  static X slope(X x, X) {
    return Sigmoid::value(x);
  }
};

// Calls f on whole vectors of the arrays; the last ones are padded with zeros.
template <class F>
inline void for_vectors(const float* x, const float* y, const float* dy, float* out, Index n, F f) {
  constexpr int lanes = simd::kLanes<float>;
  Index i = 0;
  for (; i + lanes <= n; i += lanes)
    simd::store(out + i, f(simd::load(x + i), simd::load(y + i), simd::load(dy + i), simd::load(out + i)));
  if (i == n) return;
  V tail[4] = {};
  const auto bytes = static_cast<std::size_t>(n - i) * sizeof(float);
  std::memcpy(&tail[0], x + i, bytes);
  std::memcpy(&tail[1], y + i, bytes);
  std::memcpy(&tail[2], dy + i, bytes);
  std::memcpy(&tail[3], out + i, bytes);
  const V last = f(tail[0], tail[1], tail[2], tail[3]);
  std::memcpy(out + i, &last, bytes);
}

template <class Op>
void forward(const float* x, float* y, Index n) {
  for_vectors(x, x, x, y, n, [](V v, V, V, V) { return Op::value(v); });
}
template <class Op>
void forward(const double* x, double* y, Index n) {
  for (Index i = 0; i < n; ++i) y[i] = Op::value(x[i]);
}

template <class Op>
void backward(const float* x, const float* y, const float* dy, float* dx, bool add, Index n) {
  if (add)
    for_vectors(x, y, dy, dx, n, [](V v, V w, V g, V old) { return old + g * Op::slope(v, w); });
  else
    for_vectors(x, y, dy, dx, n, [](V v, V w, V g, V) { return g * Op::slope(v, w); });
}
template <class Op>
void backward(const double* x, const double* y, const double* dy, double* dx, bool add, Index n) {
  for (Index i = 0; i < n; ++i) dx[i] = (add ? dx[i] : 0) + dy[i] * Op::slope(x[i], y[i]);
}

// Calls run(Op{}) with the operation that f names.
template <class Run>
inline void dispatch(Unary f, Run run) {
  switch (f) {
    case Unary::relu:
      return run(Relu{});
    case Unary::sigmoid:
      return run(Sigmoid{});
    case Unary::tanh:
      return run(Tanh{});
    case Unary::exp:
      return run(Exp{});
    case Unary::truncated_exp:
      return run(TruncatedExp{});
    case Unary::softplus:
      return run(Softplus{});
  }
}

}  // namespace

namespace FIELDMARK_ISA_NS {

template <class T>
void unary_forward(Unary f, const T* x, T* y, Index n) {
  dispatch(f, [=](auto op) { forward<decltype(op)>(x, y, n); });
}
template <class T>
void unary_backward(Unary f, const T* x, const T* y, const T* dy, T* dx, bool add, Index n) {
  dispatch(f, [=](auto op) { backward<decltype(op)>(x, y, dy, dx, add, n); });
}
template <>
float exp_sum(const float* x, float shift, float* y, Index n) {
  constexpr int lanes = simd::kLanes<float>;
  V acc{};
  Index i = 0;
  for (; i + lanes <= n; i += lanes) {
    const V e = Exp::value(simd::load(x + i) - shift);
    simd::store(y + i, e);
    acc += e;
  }
  const Index rest = n - i;
  V last{};
  if (rest > 0) {
    std::memcpy(&last, x + i, static_cast<std::size_t>(rest) * sizeof(float));
    last = Exp::value(last - shift);
    std::memcpy(y + i, &last, static_cast<std::size_t>(rest) * sizeof(float));
  }
  float sum = 0;
  for (int k = 0; k < lanes; ++k) sum += k < rest ? acc[k] + last[k] : acc[k];
  return sum;
}
template <>
double exp_sum(const double* x, double shift, double* y, Index n) {
  double sum = 0;
  for (Index i = 0; i < n; ++i) sum += y[i] = __builtin_exp(x[i] - shift);
  return sum;
}

template void unary_forward(Unary, const float*, float*, Index);
template void unary_forward(Unary, const double*, double*, Index);
template void unary_backward(Unary, const float*, const float*, const float*, float*, bool, Index);
template void unary_backward(Unary, const double*, const double*, const double*, double*, bool, Index);

}  // namespace FIELDMARK_ISA_NS
}  // namespace fieldmark::kernels
