#include "fieldmark/distort/noise.h"

#include <fieldmark/engine/parallel.h>

#include <string>

#include "checks.h"

namespace fieldmark::distort {

namespace {
constexpr Index kNoiseGrain = Index{1} << 14;
}

template <class T>
Var<T> noise(Var<T> x, Var<T> mu, Var<T> sigma, std::span<const std::type_identity_t<T>> normal) {
  const Index n = x.shape().size();
  check_parameter("noise", "mu", mu.shape(), 1);
  check_parameter("noise", "sigma", sigma.shape(), 1);
  check_range("noise", "sigma", static_cast<double>(sigma.value()[0]), 0, 1e6, "a standard deviation");
  if (static_cast<Index>(normal.size()) != n)
    throw ShapeError("[noise] normal: must have one element for each of x, whose shape is " +
                     x.shape().str() + ", got " + std::to_string(normal.size()));
  T* y = nullptr;
  const Var<T> out = x.tape().output(x.shape(), &y, {x, mu, sigma});
  const T* z = normal.data();
  const T m = mu.value()[0], s = sigma.value()[0];
  parallel_for(n, kNoiseGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) y[i] = x.value()[i] + (m + s * z[i]);
  });
  // dx = dy, dmu = sum dy, dsigma = sum dy z. Chunks own dx; both sums run in order, in double.
  x.tape().on_backward(out, [x, mu, sigma, z, n](const T* dy) {
    bool fresh = false;
    if (T* dx = x.grad_acc(&fresh)) {
      parallel_for(n, kNoiseGrain, [=](Index begin, Index end) {
        for (Index i = begin; i < end; ++i) dx[i] = fresh ? dy[i] : dx[i] + dy[i];
      });
    }
    if (!mu.needs_grad() && !sigma.needs_grad()) return;
    double sum = 0, weighted = 0;
    for (Index i = 0; i < n; ++i) {
      sum += static_cast<double>(dy[i]);
      weighted += static_cast<double>(dy[i]) * static_cast<double>(z[i]);
    }
    if (T* d = mu.grad_acc()) d[0] += static_cast<T>(sum);
    if (T* d = sigma.grad_acc()) d[0] += static_cast<T>(weighted);
  });
  return out;
}

template <class T>
Var<T> noise(Var<T> x, Var<T> sigma, std::span<const std::type_identity_t<T>> normal) {
  T* zero = x.tape().scratch(1);
  *zero = 0;
  return noise(x, x.tape().constant(zero, {1}), sigma, normal);
}

template Var<float> noise(Var<float>, Var<float>, Var<float>, std::span<const float>);
template Var<double> noise(Var<double>, Var<double>, Var<double>, std::span<const double>);
template Var<float> noise(Var<float>, Var<float>, std::span<const float>);
template Var<double> noise(Var<double>, Var<double>, std::span<const double>);

}  // namespace fieldmark::distort
