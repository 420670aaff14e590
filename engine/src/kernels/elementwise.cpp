#include "kernels/elementwise.h"

#include "kernels/functions.h"

namespace fieldmark::kernels {
namespace {

// Calls f on whole vectors of the arrays; the last vectors are padded with zeros.
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
