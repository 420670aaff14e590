#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/nerf/composite.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::nerf {
namespace {

constexpr Index kRayGrain = 256;  // rays per chunk

void check_offsets(std::span<const Index> ray_begin, Index samples) {
  if (ray_begin.empty() || ray_begin.back() != samples)
    throw ValueError("[composite] ray_begin must end at the sample count " + std::to_string(samples) +
                     ", got " +
                     (ray_begin.empty() ? std::string("no offsets") : std::to_string(ray_begin.back())));
  if (ray_begin.front() != 0 || !std::is_sorted(ray_begin.begin(), ray_begin.end()))
    throw ValueError("[composite] ray_begin must start at 0 and not decrease");
}

}  // namespace

template <class T>
Var<T> composite(Var<T> sigma, Var<T> rgb, Var<T> delta, std::span<const Index> ray_begin) {
  check_rank("composite", "sigma", sigma.shape(), 1, "[S]");
  check_rank("composite", "rgb", rgb.shape(), 2, "[S, 3]");
  check_rank("composite", "delta", delta.shape(), 1, "[S]");
  const Index samples = sigma.shape()[0];
  check_extent("composite", "rgb", rgb.shape(), 0, samples, "the samples of sigma");
  check_extent("composite", "rgb", rgb.shape(), 1, 3, "red, green, blue");
  check_extent("composite", "delta", delta.shape(), 0, samples, "the samples of sigma");
  check_offsets(ray_begin, samples);

  const Index rays = static_cast<Index>(ray_begin.size()) - 1;
  const Index* begin = ray_begin.data();
  Tape<T>& tape = sigma.tape();
  T* y = nullptr;
  const Var<T> out = tape.output({rays, 4}, &y, {sigma, rgb, delta});
  T* weight = tape.scratch(samples);
  T* after = tape.scratch(samples);  // T_{i+1}
  parallel_for(rays, kRayGrain, [&](Index first, Index last) {
    for (Index r = first; r < last; ++r) {
      T t = 1, c[4] = {0, 0, 0, 0};
      for (Index i = begin[r]; i < begin[r + 1]; ++i) {
        const T x = sigma.value()[i] * delta.value()[i];
        const T w = -t * std::expm1(-x);
        // For a thin sample T - w loses no precision; for a thick one the product keeps T's relative
        // precision.
        t = x < T(0.5) ? t - w : t * std::exp(-x);
        weight[i] = w;
        after[i] = t;
        for (int k = 0; k < 3; ++k) c[k] += w * rgb.value()[3 * i + k];
        c[3] += w;  // not 1 - T: that is 0 in float when sigma * delta is 1e-12
      }
      std::copy_n(c, 4, y + 4 * r);
    }
  });

  // With G_i = <dC, c_i> + dA, the definition gives
  //   dL/d(sigma_i delta_i) = T_{i+1} G_i - sum_{j>i} w_j G_j,    dL/dc_i = w_i dC.
  // The suffix sum runs far to near. Dividing by 1 - alpha_i instead, as in differentiating a product, gives
  // 0/0 at a saturated sample. A ray owns its samples.
  tape.on_backward(out, [=](const T* dy) {
    T *ds = sigma.grad_acc(), *dc = rgb.grad_acc(), *dd = delta.grad_acc();
    parallel_for(rays, kRayGrain, [&](Index first, Index last) {
      for (Index r = first; r < last; ++r) {
        const T* g = dy + 4 * r;
        T suffix = 0;
        for (Index i = begin[r + 1] - 1; i >= begin[r]; --i) {
          const T* c = rgb.value() + 3 * i;
          const T G = g[0] * c[0] + g[1] * c[1] + g[2] * c[2] + g[3];
          const T dx = after[i] * G - suffix;
          if (ds) ds[i] += delta.value()[i] * dx;
          if (dd) dd[i] += sigma.value()[i] * dx;
          if (dc)
            for (int k = 0; k < 3; ++k) dc[3 * i + k] += weight[i] * g[k];
          suffix += weight[i] * G;
        }
      }
    });
  });
  return out;
}

template Var<float> composite(Var<float>, Var<float>, Var<float>, std::span<const Index>);
template Var<double> composite(Var<double>, Var<double>, Var<double>, std::span<const Index>);

}  // namespace fieldmark::nerf
