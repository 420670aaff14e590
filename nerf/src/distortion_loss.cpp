#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/nerf/distortion_loss.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::nerf {
namespace {

void check(const Shape& sigma, std::size_t delta, std::size_t middle, std::span<const Index> ray_begin,
           double scale) {
  check_rank("distortion_loss", "sigma", sigma, 1, "[S]");
  const Index n = sigma[0];
  if (static_cast<Index>(delta) != n || static_cast<Index>(middle) != n)
    throw ShapeError("[distortion_loss] delta and middle must have an element for each of " +
                     std::to_string(n) + " samples, got " + std::to_string(delta) + " and " +
                     std::to_string(middle));
  if (ray_begin.empty() || ray_begin.front() != 0 || ray_begin.back() != n ||
      !std::is_sorted(ray_begin.begin(), ray_begin.end()))
    throw ValueError(
        "[distortion_loss] ray_begin must start at 0, not decrease and end at the sample count " +
        std::to_string(n));
  check_number("distortion_loss", "scale", scale, scale >= 0, "at least 0");
}

}  // namespace

template <class T>
Var<T> distortion_loss(Var<T> sigma, std::span<const std::type_identity_t<T>> delta,
                       std::span<const std::type_identity_t<T>> middle, std::span<const Index> ray_begin,
                       double scale) {
  check(sigma.shape(), delta.size(), middle.size(), ray_begin, scale);
  const Index n = sigma.shape()[0], rays = static_cast<Index>(ray_begin.size()) - 1;
  const Index* begin = ray_begin.data();
  const T *d = delta.data(), *m = middle.data();
  Tape<T>& tape = sigma.tape();
  T* y = nullptr;
  const Var<T> out = tape.output({1}, &y, {sigma});
  T* weight = tape.scratch(n);
  T* after = tape.scratch(n);   // T_{i+1}
  T* before = tape.scratch(n);  // sum_{j<i} w_j (m_i - m_j)
  double sum = 0;
  for (Index r = 0; r < rays; ++r) {
    T t = 1, w_sum = 0, apart = 0;
    for (Index i = begin[r]; i < begin[r + 1]; ++i) {
      const T x = sigma.value()[i] * d[i], w = -t * std::expm1(-x);
      t = x < T(0.5) ? t - w : t * std::exp(-x);
      // Accumulated step by step: differences of products m W would cancel at large distances.
      if (i > begin[r]) apart += w_sum * (m[i] - m[i - 1]);
      weight[i] = w, after[i] = t, before[i] = apart;
      sum += static_cast<double>(2 * w * apart + w * w * d[i] / 3);
      w_sum += w;
    }
  }
  const double factor = rays > 0 ? scale / static_cast<double>(rays) : 0.0;
  y[0] = static_cast<T>(factor * sum);

  // dL/dw_k = 2 sum_j w_j |m_k - m_j| + 2/3 w_k delta_k =: g_k, its sum over j < k being before_k; and with
  // dw_i/dx_k as in composite(), x = sigma delta,   dL/dx_k = T_{k+1} g_k - sum_{i>k} w_i g_i.
  tape.on_backward(out, [=](const T* dy) {
    T* ds = sigma.grad_acc();
    const T f = dy[0] * static_cast<T>(factor);
    for (Index r = 0; r < rays; ++r) {
      T w_sum = 0, apart = 0, suffix = 0;
      for (Index i = begin[r + 1] - 1; i >= begin[r]; --i) {
        if (i + 1 < begin[r + 1]) apart += w_sum * (m[i + 1] - m[i]);
        const T w = weight[i], g = 2 * (before[i] + apart) + 2 * w * d[i] / 3;
        ds[i] += f * d[i] * (after[i] * g - suffix);
        suffix += w * g;
        w_sum += w;
      }
    }
  });
  return out;
}

template Var<float> distortion_loss(Var<float>, std::span<const float>, std::span<const float>,
                                    std::span<const Index>, double);
template Var<double> distortion_loss(Var<double>, std::span<const double>, std::span<const double>,
                                     std::span<const Index>, double);

}  // namespace fieldmark::nerf
