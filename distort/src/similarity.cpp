#include "fieldmark/distort/similarity.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "checks.h"

namespace fieldmark::distort {

template <class T>
std::array<T, 6> similarity_matrix(T angle, T scale, T shift_x, T shift_y) {
  check_range("similarity", "angle", static_cast<double>(angle), -1e6, 1e6, "radians");
  check_range("similarity", "scale", static_cast<double>(scale), 1e-6, 1e6, "a zoom factor");
  T c = std::cos(angle), s = std::sin(angle);
  constexpr T kTiny = 2 * std::numeric_limits<T>::epsilon();
  if (std::abs(c) < kTiny) c = 0;
  if (std::abs(s) < kTiny) s = 0;
  const T a = c / scale, b = s / scale;
  return {a, -b, -(a * shift_x - b * shift_y), b, a, -(b * shift_x + a * shift_y)};
}

template <class T>
Var<T> similarity(Var<T> angle, Var<T> scale, Var<T> shift) {
  check_parameter("similarity", "angle", angle.shape(), 1);
  check_parameter("similarity", "scale", scale.shape(), 1);
  check_parameter("similarity", "shift", shift.shape(), 2);
  T* m = nullptr;
  const Var<T> out = angle.tape().output({6}, &m, {angle, scale, shift});
  const auto values =
      similarity_matrix(angle.value()[0], scale.value()[0], shift.value()[0], shift.value()[1]);
  std::copy(values.begin(), values.end(), m);
  // With a = cos / scale, b = sin / scale: A = [a -b; b a], t = -A shift, so
  //   da = g0 + g4 - g2 shift_x - g5 shift_y,   db = g3 - g1 + g2 shift_y - g5 shift_x,
  //   dangle = a db - b da,   dscale = -(a da + b db) / scale,   dshift = -A^T (g2, g5).
  angle.tape().on_backward(out, [angle, scale, shift, m](const T* g) {
    const T a = m[0], b = m[3], x = shift.value()[0], y = shift.value()[1];
    const T da = g[0] + g[4] - g[2] * x - g[5] * y;
    const T db = g[3] - g[1] + g[2] * y - g[5] * x;
    if (T* d = angle.grad_acc()) d[0] += a * db - b * da;
    if (T* d = scale.grad_acc()) d[0] -= (a * da + b * db) / scale.value()[0];
    if (T* d = shift.grad_acc()) {
      d[0] -= a * g[2] + b * g[5];
      d[1] -= a * g[5] - b * g[2];
    }
  });
  return out;
}

template std::array<float, 6> similarity_matrix(float, float, float, float);
template std::array<double, 6> similarity_matrix(double, double, double, double);
template Var<float> similarity(Var<float>, Var<float>, Var<float>);
template Var<double> similarity(Var<double>, Var<double>, Var<double>);

}  // namespace fieldmark::distort
