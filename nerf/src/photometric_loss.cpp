#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/nerf/photometric_loss.h>

#include <cmath>

namespace fieldmark::nerf {

template <class T>
Var<T> photometric_loss(Var<T> rays, std::span<const std::type_identity_t<T>> truth,
                        std::span<const std::type_identity_t<T>> background,
                        const PhotometricLossOptions& options) {
  check_rank("photometric_loss", "rays", rays.shape(), 2, "[R, 4]");
  check_extent("photometric_loss", "rays", rays.shape(), 1, 4, "red, green, blue, opacity");
  const Index n = rays.shape()[0];
  if (static_cast<Index>(truth.size()) != 4 * n || static_cast<Index>(background.size()) != 3 * n)
    throw ShapeError("[photometric_loss] truth and background must have 4 and 3 elements a ray (" +
                     std::to_string(n) + " rays), got " + std::to_string(truth.size()) + " and " +
                     std::to_string(background.size()));
  if (!(options.huber > 0))
    throw ValueError("[photometric_loss] huber must be positive, got " + number_text(options.huber));

  Tape<T>& tape = rays.tape();
  T* y = nullptr;
  const Var<T> out = tape.output({1}, &y, {rays});
  T* error = tape.scratch(3 * n);
  const T limit = static_cast<T>(options.huber);
  double sum = 0;
  for (Index r = 0; r < n; ++r) {
    const T *c = rays.value() + 4 * r, *p = truth.data() + 4 * r, *b = background.data() + 3 * r;
    for (Index k = 0; k < 3; ++k) {
      const T e = photometric_residual(c, p, b, k);
      error[3 * r + k] = e;
      const T a = std::abs(e);
      sum += static_cast<double>(a <= limit ? e * e / 2 : limit * (a - limit / 2));
    }
  }
  const double factor = n > 0 ? options.scale / (3.0 * static_cast<double>(n)) : 0.0;
  y[0] = static_cast<T>(factor * sum);

  // h'(e) = clamp(e, -huber, huber); de/dC = 1, de/dA = -b.
  tape.on_backward(out, [=](const T* dy) {
    T* d = rays.grad_acc();
    const T f = dy[0] * static_cast<T>(factor);
    for (Index r = 0; r < n; ++r)
      for (Index k = 0; k < 3; ++k) {
        const T e = error[3 * r + k];
        const T g = f * (e > limit ? limit : e < -limit ? -limit : e);
        d[4 * r + k] += g;
        d[4 * r + 3] -= g * background[static_cast<std::size_t>(3 * r + k)];
      }
  });
  return out;
}

template Var<float> photometric_loss(Var<float>, std::span<const float>, std::span<const float>,
                                     const PhotometricLossOptions&);
template Var<double> photometric_loss(Var<double>, std::span<const double>, std::span<const double>,
                                      const PhotometricLossOptions&);

}  // namespace fieldmark::nerf
