#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/nerf/rays.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::nerf {
namespace {
constexpr Index kPixelGrain = 1024;  // pixels per chunk, which has a partial camera gradient of 16 elements

// Terms of one ray that forward and backward share.
template <class T>
struct Projection {
  T u, v, w[3], inv_norm;
  Projection(const T* c, const T* pixel)
      : u((pixel[0] + T(0.5) - c[14]) / c[12]), v(-(pixel[1] + T(0.5) - c[15]) / c[13]), w{}, inv_norm(0) {
    for (int i = 0; i < 3; ++i) w[i] = c[4 * i] * u + c[4 * i + 1] * v - c[4 * i + 2];
    inv_norm = 1 / std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  }
};

// Adds the gradient of one ray to its camera's 16 elements and its pixel's 2; either may be null.
template <class T>
void add_ray(const T* c, const T* pixel, const T* dy, T* dc, T* dp) {
  const Projection<T> p(c, pixel);
  T along = 0, dw[3];
  for (int i = 0; i < 3; ++i) along += p.w[i] * p.inv_norm * dy[3 + i];
  for (int i = 0; i < 3; ++i) dw[i] = (dy[3 + i] - p.w[i] * p.inv_norm * along) * p.inv_norm;
  T du = 0, dv = 0;
  for (int i = 0; i < 3; ++i) {
    du += c[4 * i] * dw[i];
    dv += c[4 * i + 1] * dw[i];
  }
  du /= c[12];
  dv /= c[13];
  if (dp) {
    dp[0] += du;
    dp[1] -= dv;
  }
  if (!dc) return;
  for (int i = 0; i < 3; ++i) {
    dc[4 * i] += dw[i] * p.u;
    dc[4 * i + 1] += dw[i] * p.v;
    dc[4 * i + 2] -= dw[i];
    dc[4 * i + 3] += dy[i];
  }
  dc[12] -= du * p.u;
  dc[13] -= dv * p.v;
  dc[14] -= du;
  dc[15] += dv;
}
}  // namespace

template <class T>
Var<T> rays(Var<T> camera, Var<T> pixels) {
  check_rank("rays", "pixels", pixels.shape(), 2, "[N, 2]");
  check_extent("rays", "pixels", pixels.shape(), 1, 2, "x and y");
  const Index n = pixels.shape()[0];
  if (camera.shape().rank() != 1) {
    check_rank("rays", "camera", camera.shape(), 2, "[N, 16], or be [16]");
    check_extent("rays", "camera", camera.shape(), 0, n, "one for each of pixels");
  }
  check_extent("rays", "camera", camera.shape(), -1, 16, "pose, fx, fy, cx, cy");
  const bool shared = camera.shape().rank() == 1;
  const Index stride = shared ? 0 : 16;

  T* y = nullptr;
  Tape<T>& tape = camera.tape();
  Var<T> out = tape.output({n, 6}, &y, {camera, pixels});
  parallel_for(n, kPixelGrain, [=](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      const T* c = camera.value() + i * stride;
      const Projection<T> p(c, pixels.value() + 2 * i);
      for (int k = 0; k < 3; ++k) {
        y[6 * i + k] = c[4 * k + 3];
        y[6 * i + 3 + k] = p.w[k] * p.inv_norm;
      }
    }
  });

  // With g = dL/dd: dL/dw = (g - d <d, g>) / |w|, dL/dR = dL/dw (u, v, -1)^T, dL/d(u, v) = the first two of
  // R^T dL/dw; u and v are quotients, so du/dfx = -u / fx, du/dcx = -1 / fx, dv/dfy = -v / fy, dv/dcy = 1 /
  // fy. A ray owns its pixel, and its camera unless shared: then each chunk sums into 16 elements of its
  // own, which are added in the order of the chunks.
  tape.on_backward(out, [=](const T* dy) {
    T* dc = camera.grad_acc();
    T* dp = pixels.grad_acc();
    const Index chunks = (n + kPixelGrain - 1) / kPixelGrain;
    T* partial = shared && dc ? camera.tape().template scratch<T>(chunks * 16) : nullptr;
    if (partial) std::fill_n(partial, chunks * 16, T(0));
    parallel_for(n, kPixelGrain, [=](Index begin, Index end) {
      for (Index i = begin; i < end; ++i)
        add_ray(camera.value() + i * stride, pixels.value() + 2 * i, dy + 6 * i,
                partial ? partial + begin / kPixelGrain * 16 : (dc ? dc + i * stride : nullptr),
                dp ? dp + 2 * i : nullptr);
    });
    for (Index i = 0; partial && i < chunks * 16; ++i) dc[i % 16] += partial[i];
  });
  return out;
}

template Var<float> rays(Var<float>, Var<float>);
template Var<double> rays(Var<double>, Var<double>);

}  // namespace fieldmark::nerf
