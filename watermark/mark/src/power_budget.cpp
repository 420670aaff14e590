#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/watermark/mark/power_budget.h>

#include <cmath>

namespace fieldmark::watermark {

template <class T>
Var<T> power_budget(Var<T> x, std::span<const std::type_identity_t<T>> mask, double target) {
  check_rank("power_budget", "x", x.shape(), 2, "[P, C]");
  const Index pixels = x.shape()[0], channels = x.shape()[1];
  if (static_cast<Index>(mask.size()) != pixels)
    throw ShapeError("[power_budget] mask must have one number a row of x (" + std::to_string(pixels) +
                     "), got " + std::to_string(mask.size()));
  check_number("power_budget", "target", target, target > 0, "positive");
  T* y = nullptr;
  const Var<T> out = x.tape().output(x.shape(), &y, {x});
  double sum = 0, count = 0;
  for (Index p = 0; p < pixels; ++p) {
    const auto m = static_cast<double>(mask[static_cast<std::size_t>(p)]);
    count += m * static_cast<double>(channels);
    for (Index c = 0; c < channels; ++c) {
      const auto v = static_cast<double>(x.value()[p * channels + c]);
      sum += m * v * v;
    }
  }
  // Without a masked pixel there is no power to scale to the target: the output is 0.
  const double square = (count > 0 ? sum / count : 0) + 1e-12,
               scale = count > 0 ? target / std::sqrt(square) : 0;
  for (Index i = 0; i < pixels * channels; ++i) y[i] = static_cast<T>(scale) * x.value()[i];

  // dy/dx = scale (I - x (m x)^T / (count rms^2)): the part along x itself has no effect.
  const T* m = mask.data();
  x.tape().on_backward(out, [=](const T* dy) {
    T* dx = x.grad_acc();
    double along = 0;
    for (Index i = 0; i < pixels * channels; ++i)
      along += static_cast<double>(dy[i]) * static_cast<double>(x.value()[i]);
    const double f = count > 0 ? along / (count * square) : 0;
    for (Index i = 0; i < pixels * channels; ++i)
      dx[i] += static_cast<T>(scale * (static_cast<double>(dy[i]) - f * static_cast<double>(m[i / channels]) *
                                                                        static_cast<double>(x.value()[i])));
  });
  return out;
}

template Var<float> power_budget(Var<float>, std::span<const float>, double);
template Var<double> power_budget(Var<double>, std::span<const double>, double);

}  // namespace fieldmark::watermark
